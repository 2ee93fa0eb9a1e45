use super::*;
use crate::cell::{CameraInfo, CameraSpec, Distortion};
use std::path::PathBuf;

fn read(yaml: &str) -> Result<Intrinsics> {
    parsed(Path::new("camera_info.yaml"), yaml, None, None)
}

const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
    data: [600.5, 0, 320.25, 0, 601, 240.0, 0., 0., 1.]\ndistortion_model: MODEL\n\
    distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0.1, -0.2, 0.001, 0.002, 0.0MORE]\n\
    rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";

#[test]
fn a_ros_camera_info_file_gives_the_lens() {
    let intrinsics = read(&ROS.replace("MODEL", "plumb_bob").replace("MORE", "")).expect("a plumb bob");
    assert_eq!(intrinsics.image_size_px, [640, 480]);
    assert_eq!(intrinsics.focal_px, [600.5, 601.0]);
    assert_eq!(intrinsics.center_px, [320.25, 240.0]);
    assert_eq!(intrinsics.distortion, Distortion::PlumbBob([0.1, -0.2, 0.001, 0.002, 0.0]));
    let opencv = ROS.replace("MODEL", "plumb_bob").replace("MORE", "");
    let opencv = format!("%YAML:1.0\n---\n{}", opencv.replace("matrix:\n", "matrix: !!opencv-matrix\n"));
    assert_eq!(read(&opencv).expect("OpenCV's own form"), intrinsics);
}

#[test]
fn every_supported_model_is_read_and_others_are_refused_by_name() {
    let of = |model: &str, more: &str| read(&ROS.replace("MODEL", model).replace("MORE", more));
    let zero = of("rational_polynomial", ", 0, 0, 0").expect("reduces to plumb bob");
    assert_eq!(zero.distortion, Distortion::PlumbBob([0.1, -0.2, 0.001, 0.002, 0.0]));
    let rational =
        of("rational_polynomial", ", 0.3, 0, 0.5, 0, 0, 0, 0, 0, 0").expect("no thin prism, no tilt");
    let wanted = Distortion::RationalPolynomial([0.1, -0.2, 0.001, 0.002, 0.0, 0.3, 0.0, 0.5]);
    assert_eq!(rational.distortion, wanted);
    let fisheye = of("equidistant", "").expect("a fifth coefficient of zero is none");
    assert_eq!(fisheye.distortion, Distortion::Equidistant([0.1, -0.2, 0.001, 0.002]));
    for (model, more, words) in [
        ("plumb_bob", ", 0.3, 0, 0", "rational_polynomial"),
        ("rational_polynomial", ", 0.3, 0, 0, 0.001, 0, 0, 0", "thin prism"),
        ("rational_polynomial", ", 0.3, 0, 0, 0, 0, 0, 0, 0.01, 0", "tilt"),
        ("equidistant", "1", "k1 k2 k3 k4"),
        ("fov", "", "`plumb_bob`, `rational_polynomial` or `equidistant`"),
        ("thin_prism_fisheye", "", "`plumb_bob`"),
    ] {
        let message = of(model, more).expect_err(model).to_string();
        assert!(message.contains(model) && message.contains(words), "{message}");
    }
    let message = read("image_width: 640\nimage_height: [").expect_err("broken").to_string();
    assert!(message.contains("CameraInfo"), "{message}");
}

/// A lens as OpenCV stores it: YAML, XML, JSON; and as Python's `json` writes arrays.
fn stored(coefficients: &str, more: [&str; 3]) -> [String; 4] {
    let spaced = coefficients.replace(',', "");
    [
        format!(
            "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n{}cameraMatrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   \
             data: [ 600.5, 0., 320.25, 0., 601., 240., 0., 0., 1. ]\ndistCoeffs: !!opencv-matrix\n   rows: 1\n   cols: 5\n   \
             dt: d\n   data: [ {coefficients} ]\n",
            more[0]
        ),
        format!(
            "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_size>\n  640 480</image_size>{}<camera_matrix type_id=\"opencv-matrix\">\n\
             <rows>3</rows><cols>3</cols><dt>d</dt><data>600.5 0. 320.25 0. 601. 240. 0. 0. 1.</data></camera_matrix>\n\
             <distortion_coefficients type_id=\"opencv-matrix\"><rows>5</rows><cols>1</cols><dt>d</dt>\n<data>\n{spaced}</data>\
             </distortion_coefficients><names><_>a.png</_><_>b.png</_></names></opencv_storage>\n",
            more[1]
        ),
        format!(
            "{{\n\"imageSize\": [640, 480], {}\n\"K\": {{\"type_id\": \"opencv-matrix\", \"rows\": 3, \"cols\": 3, \"dt\": \"d\", \
             \"data\": [600.5, 0.0, 320.25, 0, 601.0, 240.0, 0, 0, 1.0]}}, \"D\": {{\"type_id\": \"opencv-matrix\", \"rows\": 1, \
             \"cols\": 5, \"dt\": \"d\", \"data\": [{coefficients}]}}}}",
            more[2]
        ),
        format!(
            "{{\"width\": 640, \"height\": 480, {} \"mtx\": 1, \"camera_matrix\": [[600.5, 0, 320.25], [0, 601, 240], [0, 0, 1]], \
             \"dist_coeffs\": [[{coefficients}]]}}",
            more[2]
        ),
    ]
}

#[test]
fn what_opencv_stores_as_yaml_xml_and_json_is_the_same_lens() {
    for text in stored("0.1, -0.2, 0.001, 0.002, 0.03", [""; 3]) {
        let lens = read(&text).expect(&text);
        assert_eq!(
            (lens.image_size_px, lens.focal_px, lens.center_px),
            ([640, 480], [600.5, 601.0], [320.25, 240.0])
        );
        assert_eq!(lens.distortion, Distortion::PlumbBob([0.1, -0.2, 0.001, 0.002, 0.03]), "{text}");
    }
    let fisheye =
        ["fisheye_model: 1\n", "<fisheye_model>1</fisheye_model>", "\"distortion_model\": \"fisheye\","];
    for text in stored("0.1, -0.2, 0.001, 0.002", fisheye) {
        let lens = read(&text).expect(&text);
        assert_eq!(lens.distortion, Distortion::Equidistant([0.1, -0.2, 0.001, 0.002]), "{text}");
    }
    let message = read(&stored("0.1, -0.2, 0.001, 0.002", [""; 3])[2]).expect_err("either model").to_string();
    assert!(message.contains("distortion_model") && message.contains("equidistant"), "{message}");
    let xi = stored("0.1, -0.2, 0.001, 0.002", ["xi: 1.2\n", "", ""]);
    assert!(read(&xi[0]).expect_err("omnidirectional").to_string().contains("omnidirectional"));
}

#[test]
fn a_printed_message_is_cropped_and_binned_as_the_camera_delivers_it() {
    let message = "header:\n  frame_id: camera\nheight: 960\nwidth: 1280\ndistortion_model: plumb_bob\nd:\n- 0.1\n- -0.2\n- 0.001\n- 0.002\n- 0.0\n\
                   k:\n- 1200.0\n- 0.0\n- 650.5\n- 0.0\n- 1202.0\n- 470.25\n- 0.0\n- 0.0\n- 1.0\nbinning_x: 2\nbinning_y: 4\nroi:\n  x_offset: 100\n  \
                   y_offset: 40\n  height: 802\n  width: 1000\n  do_rectify: false\n---\n";
    let lens = read(message).expect("a message");
    assert_eq!(lens.image_size_px, [500, 200], "803 rows of 4 give 200");
    assert_eq!(lens.focal_px, [600.0, 300.5]);
    // The pixels 100 and 101 make up pixel 0: its centre is 100.5 on the sensor.
    assert_eq!(lens.center_px, [(650.5 - 100.5) / 2.0, (470.25 - 41.5) / 4.0]);
    let whole = message.replace("binning_x: 2", "binning_x: 0").replace("width: 1000", "width: 0");
    assert!(read(&whole).expect_err("an offset without a width").to_string().contains("roi.width"));
    let whole = whole.replace("x_offset: 100", "x_offset: 0");
    assert_eq!(read(&whole).expect("all columns").center_px[0], 650.5);
    for (from, to) in [
        ("x_offset: 100", "x_offset: 1000"),
        ("binning_x: 2", "binning_x: -1"),
        ("height: 802", "height: .nan"),
    ] {
        let refused = read(&message.replace(from, to)).expect_err(to).to_string();
        assert!(refused.contains("roi.") || refused.contains("binning_x"), "{refused}");
    }
}

const CAMCHAIN: &str = "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, -0.2, 0.001, 0.002]\n  distortion_model: radtan\n  \
    intrinsics: [600.5, 601, 320.25, 240]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n\
    cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n  camera_model: pinhole\n  distortion_coeffs: [0.01, 0.02, 0.03, 0.04]\n  \
    distortion_model: equidistant\n  intrinsics: [500, 501, 321, 241]\n  resolution: [640, 480]\n";

#[test]
fn one_camera_of_a_kalibr_camchain_is_chosen_by_name() {
    let of = |text: &str, camera| parsed(Path::new("camchain.yaml"), text, camera, None);
    let only = CAMCHAIN.split("cam1:").next().expect("cam0");
    let first = of(only, None).expect("one camera");
    assert_eq!(first.distortion, Distortion::PlumbBob([0.1, -0.2, 0.001, 0.002, 0.0]));
    assert_eq!(of(CAMCHAIN, Some("cam0")).expect("the same"), first);
    let second = of(CAMCHAIN, Some("cam1")).expect("chosen");
    assert_eq!(
        (second.focal_px, second.distortion),
        ([500.0, 501.0], Distortion::Equidistant([0.01, 0.02, 0.03, 0.04]))
    );
    for camera in [None, Some("cam2")] {
        let message = of(CAMCHAIN, camera).expect_err("which?").to_string();
        assert!(message.contains("cam0, cam1") && message.contains("camchain.yaml#cam0"), "{message}");
    }
    for (from, to) in [("pinhole", "omni"), ("pinhole", "ds"), ("pinhole", "eucm"), ("radtan", "fov")] {
        let message = of(&only.replace(from, to), None).expect_err(to).to_string();
        assert!(message.contains(&format!("`{to}`")) && message.contains("radtan"), "{message}");
    }
    assert!(read(&ROS.replace("MODEL", "plumb_bob").replace("MORE", "")).is_ok());
    let named = of(&ROS.replace("MODEL", "plumb_bob").replace("MORE", ""), Some("cam1"));
    assert!(named.expect_err("one camera has no name").to_string().contains("#cam1"));
}

#[test]
fn the_camera_follows_the_name_of_the_file() {
    for (path, file, camera) in [
        ("lens/camchain.yaml#cam1", "lens/camchain.yaml", Some("cam1")),
        ("lens.yaml", "lens.yaml", None),
        ("camera#2.yaml", "camera#2.yaml", None),
    ] {
        let info = CameraInfo::from(PathBuf::from(path));
        assert_eq!(info.file_and_camera(), (PathBuf::from(file), camera.map(str::to_owned)));
    }
}

#[test]
fn a_cell_writes_its_camera_info_as_a_path_with_and_without_its_intrinsics() {
    let mut info = CameraInfo::from(PathBuf::from("lens/camera_info.yaml"));
    let text = serde_json::to_string(&info).expect("writes");
    assert_eq!(text, "\"lens/camera_info.yaml\"");
    info.intrinsics =
        Some(read(&ROS.replace("MODEL", "plumb_bob").replace("MORE", "")).expect("a plumb bob"));
    assert_eq!(serde_json::to_string(&info).expect("writes"), text);
    let spec = CameraSpec { camera_info: Some(info), ..CameraSpec::default() };
    let resolved = spec.resolved("cell.toml").expect("its intrinsics were read");
    assert_eq!((resolved.focal_px, resolved.camera_info), (Some([600.5, 601.0]), None), "fx and fy (px)");
    let unread: CameraInfo = serde_json::from_str(&text).expect("reads");
    let spec = CameraSpec { camera_info: Some(unread), ..CameraSpec::default() };
    let message = spec.resolved("cell.toml").expect_err("no intrinsics").to_string();
    assert!(message.contains("cell.toml") && message.contains("camera_info.yaml"), "{message}");
}
