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
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    // Palettes become red, green and blue.
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("fits in memory")];
    let info = reader.next_frame(&mut pixels).expect("a whole PNG");
    ((info.width, info.height), pixels.chunks(3).filter(|p| p.iter().all(|&v| v < 128)).count())
}

#[test]
fn text_is_drawn_without_a_system_font() {
    let [svg, png] = plot::draw(&Word("error [%], dx²"), (320, 60)).expect("drawn");
    let text = String::from_utf8(svg).expect("text");
    assert!(text.contains("error [%], dx²") && text.contains("viewBox"), "{text}");
    let (size, dark) = read_png(&png);
    assert_eq!(size, (320, 60));
    assert!(dark > 100, "{dark} dark pixels");
    let [_, bare] = plot::draw(&Word(""), (320, 60)).expect("drawn");
    assert_eq!(read_png(&bare).1, 0);
}
