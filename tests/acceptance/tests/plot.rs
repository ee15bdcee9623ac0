//! The pictures that examples make of their figures: drawn on a bare machine, text included.

use clay_acceptance::plot::{self, Area, FONT, Painted, Picture};
use plotters::prelude::*;

/// One word on white.
struct Word(&'static str);

impl Picture for Word {
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        area.draw(&Text::new(self.0, (10, 10), (FONT, 24).into_font().color(&BLACK)))
    }
}

/// The PNG's header and its dark pixels.
fn read_png(bytes: &[u8]) -> ((u32, u32), usize) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("fits in memory")];
    let info = reader.next_frame(&mut pixels).expect("a whole PNG");
    ((info.width, info.height), pixels.chunks(3).filter(|p| p.iter().all(|&v| v < 128)).count())
}

#[test]
fn text_is_drawn_without_a_system_font() {
    let folder = tempfile::tempdir().expect("a folder");
    let stem = folder.path().join("made/on the way/word");
    let [svg, png] = plot::write(&Word("error [%], dx²"), &stem, (320, 60)).expect("drawn");
    let text = std::fs::read_to_string(svg).expect("the SVG");
    assert!(text.contains("error [%], dx²") && text.contains("viewBox"), "{text}");
    let (size, dark) = read_png(&std::fs::read(png).expect("the PNG"));
    assert_eq!(size, (320, 60));
    assert!(dark > 100, "{dark} dark pixels");
    plot::write(&Word(""), &stem, (320, 60)).expect("drawn over");
    assert_eq!(read_png(&std::fs::read(stem.with_extension("png")).expect("the PNG")).1, 0);
}

/// A file in a folder's place is told by name.
#[test]
fn file_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("written");
    let error = plot::write(&Word("x"), &file.join("chart"), (64, 64)).expect_err("no folder").to_string();
    assert!(error.contains("chart.svg"), "{error}");
}
