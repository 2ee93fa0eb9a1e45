//! The page of a campaign's clips before anything is estimated: each film's first frame, what was found on it, and what does not fit.

use super::super::figures::{Palette, escaped};
use super::super::overlay::closed_outline;
use super::{page_of, warnings};
use crate::capture::{Camera, GreyImage};
use crate::detect::{Sample, StrikerSample, StrikerTrack, Track, Tracks};
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::{self, Object, Shape};
use crate::scene::Strike;
use crate::warning::GroupedWarnings;
use std::fmt::Write;

/// A clip and what its film shows.
#[derive(Clone, Copy, Debug)]
pub struct CheckedClip<'a> {
    /// Its name, with which the warnings about it begin.
    pub name: &'a str,
    /// Its objects, the struck one first.
    pub objects: &'a [String],
    /// The strike as `campaign.toml` gives it.
    pub strike: Option<&'a Strike>,
    /// The first frame and the camera, if there is a film that can be read.
    pub first: Option<(&'a GreyImage, &'a Camera)>,
    /// The tracks, if the objects were found.
    pub tracks: Option<&'a Tracks>,
}

/// The contents of the page.
#[derive(Clone, Copy, Debug)]
pub struct CheckPage<'a> {
    /// The name of the campaign's file.
    pub campaign: &'a str,
    /// The objects, for their outlines.
    pub objects: &'a [Object],
    /// The outline of the striker, if the cell has one.
    pub striker: Option<&'a Shape>,
    /// The clips.
    pub clips: &'a [CheckedClip<'a>],
    /// Everything that does not fit; a line about one clip begins with its name and a colon.
    pub warnings: &'a GroupedWarnings,
}

/// Pictures are reduced to about this width (px).
const PICTURE_PX: usize = 480;
/// Pictures on one page; further clips have none.
const MOST_PICTURES: usize = 400;

/// The complete page.
pub(in crate::report) fn check(page: &CheckPage) -> String {
    let palette = Palette::new(page.objects.iter().map(|object| object.name.as_str()));
    let with_warnings = page.clips.iter().filter(|clip| page.warnings_of(clip).next().is_some()).count();
    let (n, campaign) = (page.clips.len(), escaped(page.campaign));
    let conclusion = if page.warnings.lines.is_empty() {
        format!("<p class=\"conclusion yes\">All {n} clips fit their files and each other.</p>\n")
    } else {
        let of_clips = format!("{with_warnings} of {n} clips");
        format!(
            "<p class=\"conclusion doubt\">{of_clips} have something that does not fit; it is listed here and beside each.</p>\n"
        )
    };
    let mut body = conclusion + &page.warning_list();
    let _ = write!(body, "<h2>Clips</h2>\n{LEGEND}<ul class=\"clips\">\n");
    for (k, clip) in page.clips.iter().enumerate() {
        body += &page.card(k, clip, &palette);
    }
    body += "</ul>\n";
    let lead =
        "The first frame of every film with what was found on it, before anything is estimated from it.";
    page_of(&format!("Check of {campaign}"), lead, &body)
}

const LEGEND: &str = "<p>Drawn onto each frame: the outlines of the objects where they were found, and dashed where they come to rest; the path of each; \
     in black and white the striker at the given start and its given travel; in magenta \
     the striker where it is seen: where it rested, its path before the impact, and its last position there.</p>\n";

impl<'a> CheckPage<'a> {
    fn warnings_of(&self, clip: &CheckedClip<'a>) -> impl Iterator<Item = &'a str> {
        let name = clip.name;
        self.warnings.lines.iter().filter_map(move |warning| warning.strip_prefix(name)?.strip_prefix(": "))
    }

    /// The warnings of each cause; the name of a clip is a link to it.
    fn warning_list(&self) -> String {
        let item = |line: &str| {
            let of_clip = self.clips.iter().enumerate().find_map(|(number, clip)| {
                Some((number, clip.name, line.strip_prefix(clip.name)?.strip_prefix(": ")?))
            });
            of_clip.map_or_else(
                || escaped(line),
                |(number, name, text)| {
                    format!("<a href=\"#clip-{number}\">{}</a>: {}", escaped(name), escaped(text))
                },
            )
        };
        warnings::by_cause(&self.warnings.lines, &self.warnings.causes, item)
    }

    fn card(&self, number: usize, clip: &CheckedClip<'a>, palette: &Palette) -> String {
        let warnings: String = self.warnings_of(clip).fold(String::new(), |list, warning| {
            list + &format!("<li class=\"doubt\">{}</li>", escaped(warning))
        });
        let picture = clip.first.filter(|_| number < MOST_PICTURES).and_then(|(image, camera)| {
            let drawing = Drawing { page: self, clip, camera, factor: image.width.div_ceil(PICTURE_PX) };
            drawing.svg(image, palette)
        });
        let strike = clip.strike.map_or("no strike".to_owned(), |strike| {
            let (speed, heading) = (strike.speed_m_s, strike.heading_rad.to_degrees());
            format!("{speed} m/s at {heading:.1} degrees")
        });
        let (name, objects) = (escaped(clip.name), escaped(&clip.objects.join(", ")));
        let list =
            if warnings.is_empty() { warnings } else { format!("<ul class=\"warnings\">{warnings}</ul>") };
        let picture = picture.unwrap_or_else(|| "<p class=\"nothing\">no picture</p>".to_owned());
        format!("<li id=\"clip-{number}\">{picture}<h3>{name}</h3><p>{objects}; {strike}</p>{list}</li>\n")
    }
}

/// One film's first frame with what was found on it.
struct Drawing<'a, 'p> {
    page: &'a CheckPage<'p>,
    clip: &'a CheckedClip<'p>,
    camera: &'a Camera,
    /// The film's pixels over the picture's, along one side.
    factor: usize,
}

impl Drawing<'_, '_> {
    fn svg(&self, image: &GreyImage, palette: &Palette) -> Option<String> {
        let picture = image.shrunk(self.factor);
        let (width, height, url) = (picture.width, picture.height, picture.data_url()?);
        let name = escaped(self.clip.name);
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"first frame of {name}\">\
             <image width=\"{width}\" height=\"{height}\" href=\"{url}\"/>"
        );
        for track in self.clip.tracks.iter().flat_map(|tracks| &tracks.tracks) {
            self.draw_object(&mut svg, track, &palette.class(&track.object));
        }
        if let (Some(strike), Some(shape)) = (self.clip.strike, self.page.striker) {
            self.draw_strike(&mut svg, strike, shape);
        }
        if let (Some(seen), Some(shape)) =
            (self.clip.tracks.and_then(|tracks| tracks.striker.as_ref()), self.page.striker)
        {
            self.draw_striker(&mut svg, seen, shape);
        }
        Some(svg + "</svg>")
    }

    fn draw_object(&self, svg: &mut String, track: &Track, class: &str) {
        let Ok(object) = object::find(self.page.objects, &track.object, "check") else { return };
        let height_m = object.height_m;
        let path: Vec<Point> = track.samples.iter().map(Sample::position).collect();
        self.draw_line(svg, &path, height_m, &format!("filmed-path {class}"));
        let outline = |sample: &Sample| {
            let is_known = sample.yaw_rad.is_some() || matches!(object.shape, Shape::Disc { .. });
            let pose = Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
            let points = closed_outline(&object.shape).into_iter().map(|p| pose.table_from_body(p));
            is_known.then(|| points.collect::<Vec<Point>>())
        };
        for (sample, kind) in [(track.samples.last(), "filmed-end"), (track.samples.first(), "filmed")] {
            if let Some(points) = sample.and_then(outline) {
                self.draw_line(svg, &points, height_m, &format!("{kind} {class}"));
            }
        }
        if let Some(first) = track.samples.first() {
            // Above the outline
            let (center, radius_m) = (first.position(), object.shape.outer_radius_m());
            let pixel = self.camera.pixel_from_table(center, height_m);
            let up_px = 4.0 * self.factor as f64 + radius_m / self.camera.scale_m_per_px(pixel, height_m);
            let at = self.picture_pixel(Pixel::new(pixel.x, pixel.y - up_px));
            let name = escaped(&track.object);
            let _ = write!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" class=\"name halo\" text-anchor=\"middle\">{name}</text>",
                at.x, at.y
            );
        }
    }

    /// The striker at its start, and its path to the end of its travel.
    fn draw_strike(&self, svg: &mut String, strike: &Strike, shape: &Shape) {
        let along = Vec2::from_heading(strike.heading_rad);
        let end = strike.start_m + along * strike.travel_m;
        let barb = |angle_rad: f64| end - along.rotated(angle_rad) * (0.2 * strike.travel_m);
        let arrow = [strike.start_m, end, barb(0.5), end, barb(-0.5)];
        let pose = Pose { position: strike.start_m, yaw_rad: strike.heading_rad };
        let outline: Vec<Point> =
            closed_outline(shape).into_iter().map(|p| pose.table_from_body(p)).collect();
        for class in ["given-edge", "given"] {
            for points in [&outline[..], &arrow[..]] {
                self.draw_line(svg, points, 0.0, class);
            }
        }
    }

    /// The striker as it was seen: where it rested, its path, and the last position of that path.
    fn draw_striker(&self, svg: &mut String, seen: &StrikerTrack, shape: &Shape) {
        let path: Vec<Point> =
            seen.start_m.into_iter().chain(seen.samples.iter().map(StrikerSample::position)).collect();
        self.draw_line(svg, &path, 0.0, "seen");
        let yaw_rad = seen.heading_rad().value;
        for position in seen.start_m.iter().chain(path.last()) {
            let pose = Pose { position: *position, yaw_rad };
            let outline: Vec<Point> =
                closed_outline(shape).into_iter().map(|p| pose.table_from_body(p)).collect();
            self.draw_line(svg, &outline, 0.0, "seen");
        }
    }

    fn draw_line(&self, svg: &mut String, points: &[Point], height_m: f64, class: &str) {
        let pixels =
            points.iter().map(|&point| self.picture_pixel(self.camera.pixel_from_table(point, height_m)));
        let text: Vec<String> = pixels
            .filter(|p| p.x.is_finite() && p.y.is_finite())
            .map(|p| format!("{:.1},{:.1}", p.x, p.y))
            .collect();
        let _ = write!(svg, "<polyline points=\"{}\" class=\"{class}\"/>", text.join(" "));
    }

    /// From the film's pixels, whose centres are whole numbers, to the picture's coordinates, whose corners are.
    fn picture_pixel(&self, pixel: Pixel) -> Pixel {
        let factor = self.factor as f64;
        Pixel::new((pixel.x + 0.5) / factor, (pixel.y + 0.5) / factor)
    }
}
