//! The page of lost and doubtful frames as a whole.

use super::super::tests::assert_well_formed;
use super::*;
use crate::capture::{Camera, GreyImage};
use crate::detect::{Doubt, Rejection, Sighting, Spot, Tracks};
use crate::geometry::Pose;
use crate::object::{Marker, Object, Shape};

/// What was found of an object in a film of these outcomes: `.` found, `?` doubtful, `x` lost, `o` lost beside a region.
fn explained(objects: &[(&str, &str)]) -> Explained {
    let camera = Camera::flat([200, 160], 1000.0, None);
    let pose = Pose::new(0.01, -0.02, 0.0);
    let spot =
        Spot { centroid: camera.pixel_from_table(pose.position, 0.001), covariance_px2: [20.0, 0.0, 20.0] };
    let sighting = Sighting { pose, std_m: 2e-4, spot };
    let outcome = |symbol: char| match symbol {
        '.' => Outcome::Found(sighting),
        '?' => Outcome::Doubtful(sighting, vec![Doubt::Size { deviation_px: 1.3 }]),
        'o' => {
            let reason = Rejection::Taken { by: "b & <co>".into() };
            Outcome::Lost(vec![Candidate { spot, distance_m: 0.012, reason }])
        }
        _ => Outcome::Lost(Vec::new()),
    };
    let search = |(frame, symbol): (usize, char)| Search {
        frame,
        time_s: frame as f64 / 100.0,
        camera: 0,
        predicted: pose,
        radius_m: 0.03,
        outcome: outcome(symbol),
    };
    let shape = Shape::Disc { radius_m: 0.03 };
    let object = |(name, _): &(&str, &str)| Object {
        name: (*name).into(),
        shape: shape.clone(),
        height_m: 0.001,
        marker: Some(Marker::centred(Shape::Disc { radius_m: 0.01 })),
        mass_kg: None,
        support: None,
    };
    let searches = objects.iter().map(|(name, symbols)| ObjectSearches {
        object: (*name).into(),
        height_m: 0.001,
        frames: symbols.chars().enumerate().map(search).collect(),
    });
    Explained {
        tracks: Tracks { video: "x <1>.mp4".into(), warnings: vec!["a < b".into()], ..Tracks::default() },
        objects: objects.iter().map(object).collect(),
        cameras: vec![camera.clone()],
        searches: searches.collect(),
    }
}

/// The page with all frames of its film.
fn page(found: &Explained) -> String {
    let mut page = WhyPage::new(found);
    let count = found.searches.iter().map(|s| s.frames.len()).max().unwrap_or(0);
    for number in 0..count {
        let image = GreyImage { width: 200, height: 160, pixels: vec![(90 + number % 50) as u8; 200 * 160] };
        page.add(number, &Frame { time_s: number as f64 / 100.0, image });
    }
    page.html()
}

fn drawings(page: &str) -> usize {
    page.matches("data:image/png;base64,").count()
}

#[test]
fn a_film_without_lost_or_doubtful_frames_is_said_to_be_that() {
    let found = explained(&[("a", "......"), ("b & <co>", "......")]);
    let page = page(&found);
    assert_well_formed(&page);
    assert!(page.contains("Nothing is lost or doubtful: every object was found in all 6 frames"), "{page}");
    assert_eq!(drawings(&page), 0);
    assert_eq!(WhyPage::new(&found).last_frame(), None);
}

#[test]
fn each_stretch_is_shown_with_its_frames_and_its_reasons() {
    let found = explained(&[("a", "...xx?x....??...."), ("b & <co>", "..........oooo...")]);
    let page = page(&found);
    assert_well_formed(&page);
    for words in [
        "a: not found in 3 frames, doubtful in 3",
        "0.030 to 0.060 s (frames 3 to 6): not found in 3 frames, doubtful in 1",
        "0.110 to 0.120 s (frames 11 to 12): doubtful in 2 frames",
        "In 3 frames nothing of about its size, shape and shade was within 30.0 mm",
        "the size of its marker is 1.3 px off the usual one",
        "Standard deviation 0.20 mm; 0.0 mm from where it was expected",
        "12.0 mm from the expected place: it belongs to `b &amp; &lt;co&gt;`.",
        "0.020 s, frame 2: <span class=\"yes\">found</span>",
        "b &amp; &lt;co&gt;: not found in 4 frames",
    ] {
        assert!(page.contains(words), "`{words}` is not on the page");
    }
    assert!(!page.contains("was not read"), "every frame that is shown was given");
    // One for comparison and up to three of each stretch.
    assert_eq!(drawings(&page), 4 + 3 + 4);
    assert!(page.contains("a &lt; b"), "the warnings are listed");
}

#[test]
fn the_longest_stretches_are_drawn_and_the_others_counted() {
    // Every fifth stretch is longer.
    let symbols: String = (0..100).map(|k| if k % 5 == 0 { "....xxxx" } else { "....x" }).collect();
    let found = explained(&[("a", &symbols)]);
    let page = page(&found);
    assert_well_formed(&page);
    assert!(drawings(&page) <= MOST_DRAWINGS && drawings(&page) > MOST_DRAWINGS - 4, "{}", drawings(&page));
    let drawn = page.matches("<ul class=\"clips\">").count();
    assert!(
        page.contains(&format!("{} shorter ones", 100 - drawn)),
        "the number of stretches left out is said"
    );
    assert!(page.contains(&format!("<li>{} more</li>", 100 - drawn - MOST_LISTED)));
    let long = page.matches(": not found in 4 frames</h3>").count();
    assert_eq!(long, drawn.min(20), "the longest ones are drawn");
    assert!(page.len() < 400_000, "{} bytes", page.len());
}

#[test]
fn an_object_expected_outside_the_picture_is_said_to_be_there() {
    let mut found = explained(&[("a", "..xx")]);
    for search in &mut found.searches[0].frames[2..] {
        search.predicted = Pose::new(0.4, 0.0, 0.0);
    }
    let page = page(&found);
    assert_well_formed(&page);
    assert!(page.contains("It was expected outside the picture"), "{page}");
}

#[test]
fn a_frame_that_is_not_given_or_has_another_size_is_said_to_be_missing() {
    let found = explained(&[("a", "..x")]);
    let mut page = WhyPage::new(&found);
    assert_eq!(page.last_frame(), Some(2));
    let image = GreyImage { width: 20, height: 16, pixels: vec![90; 20 * 16] };
    page.add(2, &Frame { time_s: 0.02, image });
    let html = page.html();
    assert_well_formed(&html);
    assert_eq!(html.matches("was not read").count(), 2);
}
