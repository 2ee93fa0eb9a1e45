//! Charts and drawings as inline SVG in one style.
//!
//! The figures need no fonts and no scripts: text is set in the reader's own sans serif, colours are CSS variables that
//! `report.css` defines for light and dark pages.  Every object has the same colour in all figures ([`Palette`]).

mod axis;
mod bar_chart;
mod film_image;
mod interval_chart;
mod labels;
mod line_chart;
mod palette;
mod svg;
mod top_view;

pub(super) use axis::Scale;
pub(super) use bar_chart::{BarPair, LowerBound, bar_chart};
pub(super) use film_image::film_image;
pub(super) use interval_chart::{ClipDot, IntervalChart, IntervalRow, interval_chart};
pub(super) use line_chart::{Bound, LOW_PANEL_PX, Mark, PANEL_PX, Panel, Series, Stroke, line_chart};
pub(super) use palette::Palette;
pub(super) use svg::{Anchor, Svg, WIDTH_PX, escaped};
pub(super) use top_view::{Approach, CentrePath, DrawnObject, Layer, TopView, Viewport, top_view};
