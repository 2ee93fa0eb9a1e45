use super::*;
use crate::cell::{Cell, Striker, Workspace};
use crate::geometry::Point;
use crate::object::Object;
use crate::object::Shape;
use crate::report::figures::Palette;
use crate::scene::Placed;
use crate::uncertain::Estimate;

fn pages() -> FilmPages {
    FilmPages::new([640, 360], ["a", "b"]).unwrap()
}

#[test]
fn sizes_that_a_player_cannot_show_are_refused() {
    for size in [[641, 360], [640, 361], [0, 360], [640, 10_000]] {
        let message = FilmPages::new(size, []).unwrap_err().to_string();
        assert!(message.contains(&format!("{}x{}", size[0], size[1])), "{message}");
    }
}

#[test]
fn every_value_has_a_line_and_titles_are_repeated() {
    let mut properties = Properties { reference: "a".into(), ..Properties::default() };
    assert_eq!(pages().properties(&properties).len(), 0, "a page without values");
    properties.friction.insert("a".into(), Estimate::exact(0.2));
    assert_eq!(pages().properties(&properties).len(), 1);
    let value = |mean: f64| Estimate { interval_95: [0.9 * mean, 1.1 * mean], n: 3, ..Estimate::exact(mean) };
    for k in 0..40 {
        properties.friction.insert(format!("a{k}"), value(0.2 + 0.001 * f64::from(k)));
    }
    // 17 lines fit, of which one is the title.
    let lines = (pages().content().size[1] as f64 / pages().px(34.0)) as usize;
    assert_eq!(pages().properties(&properties).len(), 41_usize.div_ceil(lines - 1));
    for k in 0..2000 {
        properties.restitution.insert(format!("x{k}/y"), value(0.5));
    }
    assert_eq!(pages().properties(&properties).len(), 8, "the number of pages is bounded");
}

#[test]
fn the_objects_are_drawn_where_they_are_and_to_scale() {
    let shape = Shape::Disc { radius_m: 0.03 };
    let object =
        Object { name: "a".into(), shape, height_m: 0.03, marker: None, mass_kg: None, support: None };
    let cell = Cell::from_above(800.0, Workspace::centred([0.4, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
    let placed = Placed { object: "a".into(), position_m: Point::new(0.1, 0.05), yaw_rad: 0.0 };
    let scene = Scene::new(cell, vec![object], vec![placed]).unwrap();
    let palette = Palette::new(["a"]);
    let mut canvas = Canvas::blank([400, 300], BACKGROUND);
    let area = Area { corner: [20, 30], size: [360, 250] };
    let drawn = Drawn {
        scene: &scene,
        strike: None,
        trajectory: None,
        time_s: 0.0,
        final_poses: None,
        possible: None,
        compared: None,
    };
    drawn_table(&mut canvas, area, &drawn, &palette, 0.4);
    let image = canvas.finish();
    let pixel = |x: usize, y: usize| {
        let at = 3 * (y * image.width + x);
        [image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]]
    };
    let changed = |x: usize, y: usize| pixel(x, y) != BACKGROUND;
    for (x, y) in [(19, 100), (200, 29), (380, 100), (200, 280)] {
        assert!(!changed(x, y), "({x}, {y}) outside of the area is drawn on");
    }
    // The disc: its blue is far above its red.
    let blue: Vec<(usize, usize)> = (0..300)
        .flat_map(|y| (0..400).map(move |x| (x, y)))
        .filter(|&(x, y)| u16::from(pixel(x, y)[2]) > u16::from(pixel(x, y)[0]) + 40)
        .collect();
    let spread = |of: &dyn Fn(&(usize, usize)) -> usize| {
        blue.iter().map(of).max().unwrap() - blue.iter().map(of).min().unwrap()
    };
    let (wide, high) = (spread(&|p| p.0), spread(&|p| p.1));
    assert!(wide.abs_diff(high) <= 1 && wide > 10, "a disc is {wide} px wide and {high} px high");
}
