//! Pictures of measured figures, as SVG and PNG: the same painting on both, with a font of its own, so that a
//! bare machine draws them too.

mod axis;
mod indexed;
mod text;

pub use axis::{Axis, number, text};

use ab_glyph::FontRef;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use std::path::{Path, PathBuf};
use text::Typeset;

/// The family of all text: Ubuntu Light, which comes with the crate `epaint_default_fonts`.
pub const FONT: &str = "sans-serif";

/// Why a picture could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The picture could not be painted.
    #[error("the picture could not be painted: {0}")]
    Paint(String),
}

/// What any back end paints with.
pub type Area<B> = DrawingArea<B, Shift>;

/// What painting on `B` comes to.
pub type Painted<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// A picture, painted the same on every back end.
pub trait Picture {
    /// Paints on the whole of `area`, which is white.
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B>;
}

/// The files of a picture.
pub fn files(stem: &Path) -> [PathBuf; 2] {
    ["svg", "png"].map(|ending| stem.with_extension(ending))
}

/// The SVG and the PNG of a picture of `size` pixels.
///
/// # Errors
/// A picture that cannot be painted.
pub fn draw(picture: &impl Picture, size: (u32, u32)) -> Result<[Vec<u8>; 2], PlotError> {
    let unreadable = || PlotError::Paint("the font cannot be read".into());
    for style in [FontStyle::Normal, FontStyle::Bold] {
        register_font(FONT, style, epaint_default_fonts::UBUNTU_LIGHT).map_err(|_| unreadable())?;
    }
    let font = FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).map_err(|_| unreadable())?;
    let mut svg = String::new();
    paint_on(picture, SVGBackend::with_string(&mut svg, size))?;

    let mut pixels = vec![0; 3 * size.0 as usize * size.1 as usize];
    paint_on(picture, Typeset::new(BitMapBackend::with_buffer(&mut pixels, size), font))?;
    let png = indexed::encode(&pixels, size).map_err(|e| PlotError::Paint(e.to_string()))?;
    Ok([svg.into_bytes(), png])
}

fn paint_on<B: DrawingBackend>(picture: &impl Picture, backend: B) -> Result<(), PlotError> {
    let area = backend.into_drawing_area();
    let paint = || {
        area.fill(&WHITE)?;
        picture.paint(&area)?;
        area.present()
    };
    paint().map_err(|e: DrawingAreaErrorKind<B::ErrorType>| PlotError::Paint(e.to_string()))
}
