//! What clay files say, and every way one can be wrong.

use super::field::{FIELDS, LAW_NUMBERS};
use super::*;
use crate::sim::material::{ClayLaw, Weld};

fn error_of(text: &str) -> String {
    let error = ClayFile::from_ron(text).expect_err(text).to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("file");
    }
    folder
}

/// The error of the file `a.clay.ron` among `files`, without the folder's path.
fn error_among(files: &[(&str, &str)]) -> String {
    let folder = folder(files);
    let error = ClayFile::load(&folder.path().join("a.clay.ron")).expect_err("bad").to_string();
    assert!(!error.contains('\n'), "{error}");
    error.replace(&format!("{}/", folder.path().display()), "")
}

/// Presets and files cannot disagree: values, names, and no file without a warning that it is odd.
#[test]
fn every_file_is_its_preset() {
    for preset in Preset::ALL {
        let (_, text) = BUILT_IN.iter().find(|(name, _)| *name == preset_file(preset)).expect("built in");
        let clay = ClayFile::from_ron(text).expect(text);
        assert_eq!((clay.material, clay.name.as_str(), clay.warnings), (preset.material(), preset.name(), vec![]));
        assert_eq!(preset.material().validate(), Ok(()));
    }
}

#[test]
fn built_in_clays_are_the_folder() {
    let mut names: Vec<String> = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(FOLDER))
        .expect("folder")
        .map(|entry| entry.expect("entry").file_name().into_string().expect("name"))
        .collect();
    names.sort();
    let mut built_in = BUILT_IN.map(|(name, _)| name);
    built_in.sort_unstable();
    assert_eq!(names, built_in);
    for (name, text) in BUILT_IN {
        assert_eq!(ClayFile::from_ron(text).map(|clay| clay.warnings).expect(name), Vec::<String>::new());
    }
    // With no file at hand.
    let mut stamps = vec![];
    let source = find_from("wax.clay.ron", Path::new("/nowhere"), &mut stamps).expect("wax");
    assert_eq!(Reader { chain: vec![], stamps: &mut stamps }.load(&source).expect("wax").material, Preset::Wax.material());
    assert_eq!(find(Path::new("elsewhere/wax.clay.ron"), &mut stamps), None);
}

#[test]
fn comparison_law_is_labelled_unstable() {
    let (_, text) = BUILT_IN.iter().find(|(name, _)| name.contains("published")).expect("built in");
    let clay = ClayFile::from_ron(text).expect("clay");
    assert!(clay.material.law.is_as_published() && clay.name.contains("unstable"));
}

#[test]
fn every_key_is_read_with_and_without_unit() {
    let units = r#"Clay(
        name: "mine", density: "1.6 g/cm^3", young_modulus: "1 MPa", poisson_ratio: "40 %", yield_stress: "20 kPa", softening: "50 %",
        softening_length: "3 mm", hardening_modulus: "5 kPa", viscosity: "20 Pa s^n", flow_index: "30 %", toughness: "20 J/m^2",
        law: Worked(loss: "40 %", rate: "2", rest_time: "10 min"), weld: Sticky,
    )"#;
    let si = r#"(
        name: "mine", density: 1600, young_modulus: 1e6, poisson_ratio: 0.4, yield_stress: 20000.0, softening: 0.5,
        softening_length: 3e-3, hardening_modulus: 5e3, viscosity: 20, flow_index: 0.3, toughness: 20,
        law: Worked(loss: 0.4, rate: 2, rest_time: 600), weld: Sticky,
    )"#;
    let (units, si) = (ClayFile::from_ron(units).expect("units"), ClayFile::from_ron(si).expect("SI"));
    let expected = ClayMaterial {
        density: 1600.0,
        young_modulus: 1e6,
        poisson_ratio: 0.4,
        yield_stress: 20e3,
        softening: 0.5,
        softening_length: 0.003,
        hardening_modulus: 5e3,
        viscosity: 20.0,
        flow_index: 0.3,
        toughness: 20.0,
        law: ClayLaw::Worked { loss: 0.4, rate: 2.0, rest_time: 600.0 },
        weld: Weld::Sticky,
    };
    assert_eq!((units.material, units.name.as_str()), (expected, "mine"));
    assert_eq!(units, si);
    let mut material = expected;
    for field in FIELDS.iter().filter(|field| matches!(field.kind, Kind::Number(_))) {
        assert!(number_mut(&mut material, field.name).is_some(), "{}", field.name);
    }
    for law in ClayLaw::ALL {
        let (name, mut copy) = (law.identifier(), law);
        let numbers: Vec<String> = copy.numbers_mut().iter().map(|(name, number)| format!("{name}: {number}")).collect();
        let numbers = if numbers.is_empty() { String::new() } else { format!("({})", numbers.join(", ")) };
        assert_eq!(ClayFile::from_ron(&format!("(law: {name}{numbers})")).expect(name).material.law, law);
    }
    assert_eq!(ClayFile::from_ron("(yield_stress: inf)").expect("elastic").material.yield_stress, f64::INFINITY);
}

#[test]
fn what_is_left_out_is_as_in_the_file_extended() {
    assert_eq!(ClayFile::from_ron("()").expect("empty").material, ClayMaterial::default());
    let files = [
        ("a.clay.ron", "(extends: \"b.clay.ron\", density: 1500, law: Worked(rate: 3))"),
        ("b.clay.ron", "(extends: \"plasticine.clay.ron\", name: \"b\", softening: 0.2, colour: Red)"),
    ];
    let folder = folder(&files);
    let clay = ClayFile::load(&folder.path().join("a.clay.ron")).expect("clay");
    let law = ClayLaw::Worked { loss: 0.3, rate: 3.0, rest_time: 600.0 };
    assert_eq!(clay.material, ClayMaterial { density: 1500.0, softening: 0.2, law, ..Preset::Plasticine.material() });
    assert_eq!(clay.name, "a");
    assert!(clay.warnings[0].ends_with("b.clay.ron:1:61: unknown key `colour` is left out"), "{:?}", clay.warnings);
    // The hand's softening stays where no file names one.
    let before = ClayMaterial { softening: 0.5, softening_length: 0.01, ..ClayMaterial::default() };
    let after = clay.in_place_of(&before);
    assert_eq!((after.softening, after.softening_length, after.density), (0.2, 0.01, 1500.0));
}

#[test]
fn unknown_keys_are_warnings_with_a_guess() {
    let text = "(\n  yeild_stress: \"9 kPa\",\n  colour: Some(Rgb(1, 2, [3])), notes: (a: \"b\"),\n  law: Worked(loss: 0.1, rate: 1, rest_tme: 3, rest_time: 2),\n)";
    let clay = ClayFile::from_ron(text).expect("clay");
    let expected = [
        "clay:2:3: unknown key `yeild_stress` is left out; did you mean `yield_stress`?",
        "clay:3:3: unknown key `colour` is left out",
        "clay:3:33: unknown key `notes` is left out",
        "clay:4:35: unknown key `rest_tme` is left out; did you mean `rest_time`?",
    ];
    assert_eq!(clay.warnings, expected);
    assert_eq!(clay.material.yield_stress, 8e3);
}

#[test]
fn bad_values_are_refused_with_line_and_field() {
    let cases = [
        ("density: \"3 kPa\"", "clay:2:1: density = \"3 kPa\": `kPa` is a unit of stress; a density is given in kg/m^3, g/cm^3"),
        ("density: \"1700\"", "clay:2:1: density = \"1700\": needs a unit"),
        ("density: \"heavy\"", "clay:2:1: density = \"heavy\": must begin with a number"),
        ("density: -1", "clay:2:1: density = -1: must be finite and positive"),
        ("density: 0", "clay:2:1: density = 0"),
        ("density: NaN", "clay:2:1: density = NaN"),
        ("density: true", "clay:2:"),
        ("density: [1]", "density: "),
        ("density: (1)", "density: "),
        ("density: Soft", "density: "),
        ("density: ", "clay:2:"),
        ("density: 1, density: 2", "`density` is given twice"),
        ("young_modulus: \"1e400 Pa\"", "clay:2:1: young_modulus = inf"),
        ("young_modulus: \"1,65 MPa\"", "decimal point"),
        ("poisson_ratio: \"50 %\"", "clay:2:1: poisson_ratio = 0.5: must lie in -0.99 to 0.4999"),
        ("yield_stress: \"0 Pa\"", "clay:2:1: yield_stress = 0"),
        ("softening: 1", "clay:2:1: softening = 1"),
        ("softening_length: \"3 cells\"", "`cells` is no unit that is known here; a length is given in mm, cm, m"),
        ("hardening_modulus: -1", "clay:2:1: hardening_modulus = -1"),
        ("viscosity: \"20 Pa s\"", "a viscosity is given in Pa s^n, kPa s^n"),
        ("flow_index: 0", "clay:2:1: flow_index = 0: must lie in [0.05, 1]"),
        ("toughness: \"3 N\"", "a toughness is given in J/m^2"),
        ("toughness: -1", "clay:2:1: toughness = -1: must be finite and not negative"),
        ("law: Soft", "`Soft` is no law; known are Softened, Worked"),
        ("law: 3", "clay:2:"),
        ("law: Worked", "clay:2:"),
        ("law: Softened(loss: 1)", "clay:2:"),
        ("law: Worked(loss: 0.1, rate: 1)", "clay:2:1: law = Worked: needs `rest_time`"),
        ("law: Worked(loss: 0.1, rate: 1,\nrest_time: \"3 m\")", "clay:2:1: rest_time = \"3 m\": `m` is a unit of length"),
        ("law: Worked(loss: 0.1, rate: 1,\nrest_time: 0)", "clay:3:1: rest_time = 0: must be a positive time"),
        ("law: Worked(rate: 1, rest_time: 1, loss: \"100 %\")", "loss = 1: must lie in [0, 1)"),
        ("name: 3", "name: "),
        ("extends: soft", "extends: "),
    ];
    for (entry, part) in cases {
        let error = error_of(&format!("(\n{entry},\n)"));
        assert!(error.starts_with("clay:") && error.contains(part), "`{entry}` gave `{error}`");
    }
    for text in ["", "(", "density: 1", "[1]", "(density: 1))", "Mud()", "(density: \"1 kg/m^3)", "\u{0}", "(r#\u{1f}: 1)"] {
        assert!(error_of(text).starts_with("clay:"), "{text}");
    }
}

#[test]
fn bad_chains_are_refused_with_line_and_field() {
    let to = |name: &str| format!("(\n extends: \"{name}\")");
    let missing = error_among(&[("a.clay.ron", &to("nope.clay.ron"))]);
    assert!(
        missing.starts_with("a.clay.ron:2:2: extends = \"nope.clay.ron\": is neither in ") && missing.contains("wax.clay.ron")
    );
    let own = error_among(&[("a.clay.ron", &to("a.clay.ron"))]);
    assert_eq!(own, "a.clay.ron:2:2: extends = \"a.clay.ron\": goes in a circle: a.clay.ron -> a.clay.ron");
    let circle = [("a.clay.ron", to("b.clay.ron")), ("b.clay.ron", to("./c.clay.ron")), ("c.clay.ron", to("b.clay.ron"))];
    let circle = error_among(&circle.each_ref().map(|(name, text)| (*name, text.as_str())));
    assert!(
        circle.starts_with("./c.clay.ron:2:2: ") && circle.contains("circle: b.clay.ron -> ./c.clay.ron -> b.clay.ron"),
        "{circle}"
    );
    // A fault is named where it is.
    let base = error_among(&[("a.clay.ron", &to("b.clay.ron")), ("b.clay.ron", "(\n\n density: \"3 s\")")]);
    assert!(base.starts_with("b.clay.ron:3:2: density"), "{base}");
    let names: Vec<String> =
        (0..=CHAIN_MAX).map(|i| if i == 0 { "a.clay.ron".into() } else { format!("{i}.clay.ron") }).collect();
    let texts: Vec<String> = (0..=CHAIN_MAX).map(|i| names.get(i + 1).map_or("()".into(), |next| to(next))).collect();
    let long: Vec<(&str, &str)> = names.iter().map(String::as_str).zip(texts.iter().map(String::as_str)).collect();
    assert!(error_among(&long).contains("chain of more than 16 files"));
    let error = ClayFile::load(Path::new("nowhere/none.clay.ron")).expect_err("missing").to_string();
    assert!(error.starts_with("nowhere/none.clay.ron: "), "{error}");
}

/// Stamps tell that a file has changed, come or gone.
#[test]
fn stamps_tell_of_changes() {
    let folder = folder(&[("a.clay.ron", "(extends: \"b.clay.ron\")")]);
    let [a, b] = ["a.clay.ron", "b.clay.ron"].map(|name| folder.path().join(name));
    let is_current = |stamps: &[FileStamp]| stamps.iter().all(|stamp| stamp.renewed() == *stamp);
    let mut stamps = vec![];
    assert!(ClayFile::load_stamped(&a, &mut stamps).is_err() && is_current(&stamps));
    std::fs::write(&b, "(density: 1000)").expect("file");
    assert!(!is_current(&stamps));
    stamps.clear();
    assert!(ClayFile::load_stamped(&a, &mut stamps).is_ok() && is_current(&stamps));
    std::fs::write(&b, "(density: 1000.0)").expect("file");
    assert!(!is_current(&stamps));
    stamps.clear();
    assert!(ClayFile::load_stamped(&a, &mut stamps).is_ok());
    std::fs::remove_file(&a).expect("gone");
    assert!(!is_current(&stamps));
}

/// Texts that are damaged anywhere are read or refused in one line, never worse.
#[test]
fn damaged_texts_are_refused_in_one_line() {
    let (_, text) = BUILT_IN[1];
    for at in (0..text.len()).filter(|at| text.is_char_boundary(*at)) {
        for damage in ["", ")", "(", "\"", "0", "é", "//", "Some("] {
            let cut = format!("{}{damage}", &text[..at]);
            let replaced = format!("{}{damage}{}", &text[..at], text.get(at + 1..).unwrap_or_default());
            for damaged in [cut, replaced] {
                if let Err(error) = ClayFile::from_ron(&damaged) {
                    assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }
    }
    // The laws that the texts above name have no numbers but these.
    for mut law in ClayLaw::ALL {
        assert!(law.numbers_mut().iter().all(|(name, _)| LAW_NUMBERS.iter().any(|field| field.name == *name)), "{law:?}");
    }
}
