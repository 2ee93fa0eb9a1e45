use super::*;

fn read(text: &str) -> Result<Arm> {
    arm(text, "arm.urdf", None)
}

/// A chain of `joints` revolute joints with a gripper.
fn text(joints: usize) -> String {
    let mut text = String::from("<robot name=\"made_up\"><link name=\"world\"/><link name=\"l0\"/>");
    text.push_str("<joint name=\"w\" type=\"fixed\"><parent link=\"world\"/><child link=\"l0\"/></joint>");
    for k in 0..joints {
        let inertial = "<inertial><origin xyz=\"0 0 0.1\"/><mass value=\"2\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" \
                        iyy=\"0.01\" iyz=\"0\" izz=\"0.002\"/></inertial>";
        let _ = write!(
            text,
            "<link name=\"l{}\">{inertial}</link><joint name=\"j{k}\" type=\"revolute\"><parent link=\"l{k}\"/>\
             <child link=\"l{}\"/><origin xyz=\"0 0 0.2\" rpy=\"{} 0 0\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"-2\" upper=\"2\" effort=\"50\" velocity=\"2\"/></joint>",
            k + 1,
            k + 1,
            if k % 2 == 0 { 1.5 } else { -1.5 }
        );
    }
    let _ = write!(
        text,
        "<link name=\"hand\"><inertial><mass value=\"0.5\"/><inertia ixx=\"0.001\" ixy=\"0\" ixz=\"0\" iyy=\"0.001\" \
         iyz=\"0\" izz=\"0.001\"/></inertial><collision><geometry><box size=\"0.2 0.06 0.08\"/></geometry></collision>\
         </link><joint name=\"h\" type=\"fixed\"><parent link=\"l{joints}\"/><child link=\"hand\"/>\
         <origin xyz=\"0 0 0.1\"/></joint><link name=\"finger\"/><joint name=\"f\" type=\"prismatic\">\
         <parent link=\"hand\"/><child link=\"finger\"/></joint></robot>"
    );
    text
}

#[test]
fn a_hand_is_part_of_the_last_link_and_its_finger_stays_at_zero() {
    let arm = read(&text(6)).expect("a good file");
    assert_eq!(arm.joint_count(), 6);
    assert_eq!(arm.flange, "hand");
    let last = &arm.links[5];
    assert!((last.inertia.mass_kg - 2.5).abs() < 1e-12, "{} kg", last.inertia.mass_kg);
    assert!((last.capsules[0].radius_m - 0.05).abs() < 1e-12, "the box is 0.1 m across its diagonal");
    assert!(arm.warnings.iter().any(|w| w.contains("`f`")), "{:?}", arm.warnings);
}

#[test]
fn an_arm_written_and_read_again_is_the_same() {
    let tool = Tool { offset_m: Vector3::new(0.0, 0.01, 0.2), mass_kg: 0.3 };
    for arm in [Arm::built_in("indy7").expect("built in"), read(&text(7)).expect("a good file")] {
        let arm = arm.with_tool(tool).expect("a tool");
        let again = super::arm(&arm.urdf(), "again.urdf", Some("tip")).expect("what was just written");
        let angles = [0.3, -0.5, 0.9, -1.2, 0.4, 0.8, 1.1];
        let apart = (arm.tip(&angles).to_homogeneous() - again.tip(&angles).to_homogeneous()).amax();
        assert!(apart < 1e-12, "tips {apart} m apart");
        let mass = (arm.mass_matrix(&angles) - again.mass_matrix(&angles)).amax();
        assert!(mass < 1e-12, "mass matrices {mass} kg m2 apart");
    }
}

#[test]
fn five_and_eight_joints_are_refused_with_their_number() {
    for joints in [5, 8] {
        let message = read(&text(joints)).expect_err("no arm").to_string();
        assert!(
            message.contains(&format!("{joints} revolute joints")) && message.contains("six or seven"),
            "{message}"
        );
    }
}

#[test]
fn errors_name_the_wrong_element() {
    let good = text(6);
    for (from, to, expected) in [
        ("velocity=\"2\"", "velocity=\"0\"", "joint `j0`"),
        ("effort=\"50\"", "", "limit effort is missing"),
        ("lower=\"-2\"", "lower=\"3\"", "from 3 to 2 rad"),
        ("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>", "its axis"),
        ("<mass value=\"2\"/>", "<mass value=\"heavy\"/>", "`heavy`"),
        ("<mass value=\"2\"/>", "<mass value=\"-2\"/>", "the mass of link `l1`"),
        ("size=\"0.2 0.06 0.08\"", "size=\"0.2 -0.06 0.08\"", "`size` of a collision shape"),
        ("<box size=\"0.2 0.06 0.08\"/>", "<sphere radius=\"1e9\"/>", "`radius` of a collision shape"),
        ("xyz=\"0 0 0.2\"", "xyz=\"0 0 1e200\"", "an origin's `xyz`"),
        ("rpy=\"1.5 0 0\"", "rpy=\"1e9 0 0\"", "an origin's `rpy`"),
        ("<parent link=\"l0\"/>", "<parent link=\"nobody\"/>", "is not a link of the file"),
        ("</robot>", "", "close"),
        ("<robot name", "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name", ""),
        ("<link name=\"world\"/>", "<link name=\"world\"/><link name=\"stray\"/>", "needed: one root"),
    ] {
        let result = read(&good.replacen(from, to, 1));
        match result {
            Err(e) => assert!(!expected.is_empty() && e.to_string().contains(expected), "{expected}: {e}"),
            Ok(_) => assert!(expected.is_empty(), "`{to}` was taken"),
        }
    }
}

#[test]
fn the_error_of_a_xacro_file_gives_the_command_that_expands_it() {
    let text = "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"a\"><xacro:property name=\"b\"/></robot>";
    let message = read(text).expect_err("xacro").to_string();
    assert!(message.contains("xacro arm.xacro"), "{message}");
}

/// A chain of links, `depth` deep.
fn long_chain(depth: usize) -> String {
    let mut text = String::from("<robot name=\"long\"><link name=\"l0\"/>");
    for k in 0..depth {
        let _ = write!(
            text,
            "<link name=\"l{0}\"/><joint name=\"j{0}\" type=\"fixed\"><parent link=\"l{k}\"/><child link=\"l{0}\"/></joint>",
            k + 1
        );
    }
    text + "</robot>"
}

#[test]
fn a_file_with_more_links_than_a_robot_has_is_refused_by_their_number() {
    // 6.5 MB: copies of the way to every link would need more memory than there is.
    let text = long_chain(60_000);
    assert!(text.len() > 6_000_000, "{} bytes", text.len());
    let message = read(&text).expect_err("too many links").to_string();
    assert!(message.contains("60001") && message.contains("at most 1001"), "{message}");
    let shapes =
        "<collision><geometry><mesh filename=\"package://a/b.stl\"/></geometry></collision>".repeat(6000);
    let message =
        read(&format!("<robot name=\"r\"><link name=\"l\">{shapes}</link></robot>")).expect_err("shapes");
    assert!(
        message.to_string().contains("6000") && message.to_string().contains("collision shapes"),
        "{message}"
    );
    let roots = (0..1000).fold(String::new(), |text, k| text + &format!("<link name=\"l{k}\"/>"));
    let message = read(&format!("<robot name=\"r\">{roots}</robot>")).expect_err("many roots").to_string();
    assert!(message.contains("and 995 more") && message.len() < 300, "{message}");
}

#[test]
fn files_that_cost_the_parser_more_than_their_size_are_refused() {
    let attributes = (0..101).fold(String::new(), |text, k| text + &format!(" a{k}=\"\""));
    // Every element with a name space of its own copies those of its parent.
    let spaces = (0..1001).fold(String::new(), |text, k| text + &format!("<a xmlns:n{k}=\"u\">"));
    for (text, words) in [
        (format!("<robot name=\"r\"><link{attributes}/></robot>"), ["attributes of an element", "101"]),
        (format!("<robot name=\"r\">{spaces}"), ["name spaces", "1001"]),
        (
            format!("<robot name=\"r\">{}</robot>", "<a/>".repeat(1_000_001)),
            ["number of elements", "1000000"],
        ),
        (" ".repeat((32 << 20) + 1), ["size in bytes", "33554433"]),
        ("<!DOCTYPE a [<!ENTITY b \"c\">]><robot name=\"&b;\"/>".into(), ["arm.urdf", "DTD"]),
    ] {
        let message = read(&text).expect_err("too much").to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
    }
    let twice =
        text(6).replacen("<link name=\"finger\"/>", "<link name=\"finger\"/><link name=\"finger\"/>", 1);
    assert!(read(&twice).expect_err("a link twice").to_string().contains("`finger` is given twice"));
}

#[test]
fn a_mesh_is_named_with_its_package_and_its_link_counts_as_thick() {
    let capsules = |shapes: &str| {
        let text = text(6).replacen("</inertial></link>", &format!("</inertial>{shapes}</link>"), 1);
        let arm = read(&text).expect("a good file");
        (arm.links[0].capsules.clone(), arm.warnings.join("\n"))
    };
    let ball = "<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>";
    let mesh =
        "<collision><geometry><mesh filename=\"package://some_arm/meshes/l1.stl\"/></geometry></collision>";
    let (assumed, warnings) = capsules("");
    assert!(!warnings.contains("not read"), "{warnings}");
    let (of_ball, _) = capsules(ball);
    assert_eq!(of_ball.iter().map(|capsule| capsule.radius_m).collect::<Vec<_>>(), [0.01]);
    for shapes in [mesh.to_owned(), format!("{ball}{mesh}")] {
        let (found, warnings) = capsules(&shapes);
        assert!(assumed.iter().all(|capsule| found.contains(capsule)), "{found:?}");
        for word in ["package://some_arm/meshes/l1.stl", "packages [\"some_arm\"]", "12 cm"] {
            assert!(warnings.contains(word), "`{word}` is not in: {warnings}");
        }
    }
}

#[test]
fn a_chain_of_the_largest_length_and_elements_deep_in_each_other_are_read() {
    let message = read(&long_chain(1000)).expect_err("no revolute joint").to_string();
    assert!(message.contains("0 revolute joints"), "{message}");
    let deep = format!("<robot name=\"r\">{}{}</robot>", "<a>".repeat(200_000), "</a>".repeat(200_000));
    let message = read(&deep).expect_err("no link").to_string();
    assert!(message.contains("one root"), "{message}");
}
