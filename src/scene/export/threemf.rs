//! 3MF (core specification 1.x): a package of one model, an object per body, unit millimetre.

use crate::surface::mesh::Mesh;
use std::io::{self, BufWriter, Seek, Write};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;
const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;
/// Rows of the matrix that row vectors are multiplied with: +Y, up in the clay's world, becomes +Z, up on a
/// printer.
const Y_TO_Z: &str = "1 0 0 0 0 1 0 -1 0 0 0 0";

/// Writes the bodies as objects `body_1`, `body_2`, ... The time of the entries is 1980, so that equal bodies
/// give equal files.
pub(super) fn write(out: &mut (impl Write + Seek), bodies: &[Mesh]) -> io::Result<()> {
    let mut package = ZipWriter::new(out);
    let options = SimpleFileOptions::default();
    for (name, text) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONSHIPS)] {
        package.start_file(name, options)?;
        package.write_all(text.as_bytes())?;
    }
    // A model of more than 4 GiB needs zip64, announced before it is written.
    let triangles: usize = bodies.iter().map(|b| b.triangles.len()).sum();
    package.start_file("3D/3dmodel.model", options.large_file(triangles > TRIANGLES_SMALL))?;
    // The packer would take each number on its own.
    let mut buffered = BufWriter::new(&mut package);
    write_model(&mut buffered, bodies)?;
    buffered.flush()?;
    drop(buffered);
    package.finish()?;
    Ok(())
}

/// Triangles whose model is surely under 4 GiB: with half as many vertices, at most 70 + 80 / 2 bytes each.
const TRIANGLES_SMALL: usize = 30_000_000;

fn write_model(out: &mut impl Write, bodies: &[Mesh]) -> io::Result<()> {
    writeln!(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>")?;
    let namespace = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
    writeln!(out, "<model unit=\"millimeter\" xml:lang=\"en-US\" xmlns=\"{namespace}\">")?;
    writeln!(out, "<metadata name=\"Application\">bevy_clay {}</metadata>\n<resources>", env!("CARGO_PKG_VERSION"))?;
    for (number, body) in (1..).zip(bodies) {
        writeln!(out, "<object id=\"{number}\" type=\"model\" name=\"body_{number}\">\n<mesh>\n<vertices>")?;
        for [x, y, z] in &body.positions {
            writeln!(out, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>")?;
        }
        writeln!(out, "</vertices>\n<triangles>")?;
        for [a, b, c] in &body.triangles {
            writeln!(out, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")?;
        }
        writeln!(out, "</triangles>\n</mesh>\n</object>")?;
    }
    writeln!(out, "</resources>\n<build>")?;
    for number in 1..=bodies.len() {
        writeln!(out, "<item objectid=\"{number}\" transform=\"{Y_TO_Z}\"/>")?;
    }
    writeln!(out, "</build>\n</model>")
}
