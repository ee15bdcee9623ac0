//! Every way a scene file can be wrong, with the line it names.

use super::*;

const CLAY: &str = "clay: [Box(size: (0.04, 0.04, 0.04))]";

fn error_of(text: &str) -> String {
    let error = ClayScene::from_ron(text).expect_err(text).to_string();
    assert!(!error.contains('\n') && error.starts_with("scene"), "{error}");
    error
}

#[test]
fn shortest_scene_has_the_defaults() {
    let scene = ClayScene::from_ron(&format!("({CLAY}, cell_width: 0.004)")).expect("scene");
    assert_eq!((scene.particles_per_cell, scene.jitter, scene.frame_time), (8, 0.25, 1.0 / 60.0));
    assert_eq!(scene.walls.low, [Wall::Separate, Wall::Stick, Wall::Separate]);
    let (material, warnings) = scene.clay_material(Path::new("."), &mut vec![]).expect("material");
    assert_eq!((scene.gravity, material, warnings), (DVec3::new(0.0, -9.81, 0.0), Preset::SoftClay.material(), vec![]));
    assert_eq!((scene.outputs.surface.as_deref(), scene.outputs.tier), (Some("surface.stl"), Tier::Fine));
}

#[test]
fn every_field_is_read() {
    let text = r#"(
        clay: [
            Sphere(radius: 0.01, center: (0, 0.1, 0)), Cylinder(radius: 0.01, height: 0.02),
            Mesh(path: "a.stl", height: 0.08, position: (0, 0, 0), rotation: (axis: (1, 0, 0), degrees: -90)),
        ],
        cell_width: 2e-3, particles_per_cell: 27, jitter: 0, seed: 5,
        material: Values(density: 1000, young_modulus: 1e5, poisson_ratio: 0.3, yield_stress: inf),
        softening: 0.5, softening_length: 0.01, gravity: (0, 0, 0),
        domain: (low: (-1, 0, -1), high: (1, 1, 1)), walls: (low: (Slip, Stick, Separate)),
        tools: [(
            name: "blade", shape: Blade(half_width: 0.02, half_height: 0.03), contact: Separate(friction: 0.1),
            keyframes: [(time: 0, position: (0, 0.1, 0)), (time: 1, position: (0, 0, 0), rotation: (axis: (0, 1, 0), degrees: 90))],
        )],
        inertia: Fast, frame_time: 0.01, duration: 2, time_step: 1e-5,
        outputs: (surface: None, tier: Coarse, particles: false),
    )"#;
    let scene = ClayScene::from_ron(text).expect("scene");
    assert_eq!((scene.clay.len(), scene.tools[0].keyframes.len(), scene.time_step), (3, 2, Some(1e-5)));
    let (material, _) = scene.clay_material(Path::new("."), &mut vec![]).expect("material");
    assert_eq!((material.density, material.softening, material.softening_length), (1000.0, 0.5, 0.01));
    assert_eq!((scene.walls.low[1], scene.walls.high[1], scene.inertia), (Wall::Stick, Wall::Separate, InertiaScaling::Fast));
    let expected = Outputs { surface: None, tier: Tier::Coarse, particles: false, metrics: true, ..Outputs::default() };
    assert_eq!(scene.outputs, expected);
}

#[test]
fn bad_values_are_refused_with_line_and_field() {
    let tool = |keyframes: &str| format!("tools: [(shape: Sphere(radius: 0.01),\nkeyframes: [{keyframes}])]");
    let values = |young: &str, nu: &str| {
        format!("material: Values(density: 1700, young_modulus: {young}, poisson_ratio: {nu}, yield_stress: 8e3)")
    };
    let cases = [
        ("colour: Red".to_string(), "scene:3:", "unknown field `colour`"),
        ("walls: (lo: (Slip, Slip, Slip))".into(), "scene:3:", "unknown field `lo`"),
        ("material: Preset(Butter)".into(), "scene:3:", "unknown `Butter`"),
        (values("-4.4e5", "0.45"), "scene:3:", "young_modulus = -440000: must be finite and positive"),
        (values("4.4e5", "0.5"), "scene:3:", "poisson_ratio = 0.5: must lie in -0.99 to 0.4999"),
        (values("4.4e5", "0.4999999999"), "scene:3:", "poisson_ratio = 0.4999999999: must lie in -0.99 to 0.4999"),
        (values("4.4e5", "-0.99999999999"), "scene:3:", "poisson_ratio = -0.99999999999: must lie in -0.99 to 0.4999"),
        (values("4.4e5, youngs: 1", "0.5"), "scene:3:", "unknown field `youngs`"),
        ("softening: 1".into(), "scene", "softening = 1: must lie in [0, 1)"),
        ("time_step: 0".into(), "scene:3:", "time_step = 0: must be a positive time"),
        ("time_step: -1e-5".into(), "scene:3:", "time_step = -0.00001"),
        ("frame_time: 0".into(), "scene:3:", "frame_time = 0"),
        ("duration: -1".into(), "scene:3:", "duration = -1"),
        ("duration: NaN".into(), "scene:3:", "duration = NaN"),
        ("jitter: 0.5".into(), "scene:3:", "jitter = 0.5: must lie in [0, 0.5)"),
        ("particles_per_cell: 65".into(), "scene:3:", "particles_per_cell = 65: must lie in 1 to 64"),
        ("particles_per_cell: -8".into(), "scene:3:", "particles_per_cell = -8: must lie in 1 to 64"),
        ("particles_per_cell: 1.5".into(), "scene:3:", "particles_per_cell = 1.5: must be a whole number"),
        ("particles_per_cell: \"a\"".into(), "scene:3:", "particles_per_cell: "),
        ("seed: 1.5".into(), "scene:3:", "seed = 1.5: must be a whole number"),
        ("seed: -1".into(), "scene:3:", "seed = -1: must be a whole number"),
        ("seed: \"a\"".into(), "scene:3:", "seed: "),
        ("gravity: (0, inf, 0)".into(), "scene:3:", "gravity = [0, inf, 0]: must be finite"),
        ("domain: (low: (0, 0, 0), high: (1, 0, 1))".into(), "scene", "low < high"),
        (tool(""), "scene:4:", "keyframes = []"),
        (
            tool("(time: 1, position: (0, 0, 0)), (time: 0.5, position: (0, 0, 0))"),
            "scene:4:",
            "keyframes.time = 0.5: must be later",
        ),
        (tool("(time: 1, position: (0, 0, 0), rotation: (axis: (0, 0, 0), degrees: 1))"), "scene:4:", "rotation.axis"),
        (
            tool("(time: 1, position: (0, 0, 0), rotation: (axis: (1e-161, 0, 0), degrees: 45))"),
            "scene:4:",
            "rotation.axis = [0.",
        ),
        (tool("(time: 1, position: (0, 0, 0), pose: 1)"), "scene:4:", "unknown field `pose`"),
        ("tools: [(shape: Sphere(radius: -1), keyframes: [(time: 0, position: (0, 0, 0))])]".into(), "scene:3:", "radius = -1"),
        ("tools: [(shape: Sphere(radius: 1, height: 2), keyframes: [])]".into(), "scene:3:", "unknown field `height`"),
        ("outputs: (surface: \"../x.stl\")".into(), "scene", "without folders"),
        ("outputs: (surface: \"x.fbx\")".into(), "scene", "outputs.surface = x.fbx: must end in .stl, .ply, .obj, .glb or .3mf"),
        ("outputs: (surface: \"a\\nb.stl\")".into(), "scene", "outputs.surface = a b.stl: must hold no control characters"),
        ("outputs: (export: (volume_min: -1))".into(), "scene", "volume_min = -1"),
        ("outputs: (export: (simplify: 0))".into(), "scene", "simplify = 0"),
        ("outputs: (export: (bodies: Melted))".into(), "scene:3:", "Melted"),
    ];
    for (field, place, part) in cases {
        let error = error_of(&format!("(\n{CLAY}, cell_width: 0.004,\n{field},\n)"));
        assert!(error.starts_with(place) && error.contains(part), "`{field}` gave `{error}`");
    }
}

#[test]
fn bad_clay_is_refused_with_line_and_field() {
    let cases = [
        ("(\nclay: [],\ncell_width: 0.004)", "scene: clay = []"),
        (
            "(\nclay: [Sphere(radius: 0.1)],\ncell_width: -0.1)",
            "scene:3:13: cell_width = -0.1: must be a positive length in metres",
        ),
        ("(\nclay: [Sphere(radius: 0.1)],\ncell_width: 0)", "cell_width = 0"),
        ("(\nclay: [Sphere(radius: 0.1)])", "missing field `cell_width`"),
        ("(\nclay: [Box(size: (0.1, 0, 0.1))],\ncell_width: 0.004)", "size = 0"),
        ("(\nclay: [Cylinder(radius: 1, height: -1)], cell_width: 0.004)", "scene:2:"),
        (
            "(\nclay: [Mesh(path: \"a.obj\", height: 1, scale: 2)], cell_width: 0.004)",
            "height = a.obj: not together with `scale`",
        ),
        ("(\nclay: [Sphere(radius: 0.1)]\ncell_width: 0.1)", "scene:3:1"),
        ("(clay: [Sphere(radius: 0.1)], cell_width: 0.1", "scene:1:"),
        ("", "scene:1:1"),
    ];
    for (text, part) in cases {
        let error = error_of(text);
        assert!(error.contains(part), "`{text}` gave `{error}`");
    }
}

#[test]
fn missing_scene_file_is_named() {
    let error = ClayScene::load(Path::new("nowhere/none.scene.ron")).expect_err("missing").to_string();
    assert!(error.starts_with("nowhere/none.scene.ron: "), "{error}");
}

/// A clay file is looked for beside the scene, then among the clays of the crate; what is odd about it and
/// what is wrong with it is said as of the scene.
#[test]
fn material_comes_from_a_clay_file() {
    let folder = tempfile::tempdir().expect("folder");
    let material = |field: &str| {
        let scene = ClayScene::from_ron(&format!("({CLAY}, cell_width: 0.004, {field})")).expect("scene");
        scene.build(folder.path()).map(|built| (built.snapshot.material, built.warnings)).map_err(|e| e.to_string())
    };
    assert_eq!(material("material: File(\"wax.clay.ron\")"), Ok((Preset::Wax.material(), vec![])));
    let softened = ClayMaterial { softening: 0.5, ..Preset::Wax.material() };
    assert_eq!(material("material: File(\"wax.clay.ron\"), softening: 0.5"), Ok((softened, vec![])));
    let write = |text: &str| std::fs::write(folder.path().join("wax.clay.ron"), text).expect("file");
    write("(density: \"1 g/cm^3\",\ncolor: Red)");
    let (own, warnings) = material("material: File(\"wax.clay.ron\")").expect("own");
    assert_eq!(own, ClayMaterial { density: 1000.0, ..ClayMaterial::default() });
    assert!(warnings.len() == 1 && warnings[0].ends_with("wax.clay.ron:2:1: unknown key `color` is left out"), "{warnings:?}");
    write("(density: \"1 g\")");
    let error = material("material: File(\"wax.clay.ron\")").expect_err("bad");
    assert!(error.contains("wax.clay.ron:1:2: density = \"1 g\""), "{error}");
    let error = material("material: File(\"lard.clay.ron\")").expect_err("missing");
    assert!(error.starts_with("scene: material = \"lard.clay.ron\": is neither in ") && !error.contains('\n'), "{error}");
    assert!(material("material: File(\"plasticine.clay.ron\"), softening: 0.1").is_ok());
}
