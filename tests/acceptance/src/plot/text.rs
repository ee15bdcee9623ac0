//! Text of bitmaps: glyphs at fractions of a pixel, kerned, with their bearings, which plotters leaves out;
//! anchored as in the SVG.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use plotters::prelude::BitMapBackend;
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};

/// Font size over the height that plotters counts, as its SVG has it.
const EM: f64 = 1.0 / 1.24;
/// Exponent on coverage: a light face at small size is too pale with 1.
const WEIGHT: f32 = 0.75;

/// A bitmap whose text is set with care.
pub(super) struct Typeset<'a> {
    bitmap: BitMapBackend<'a>,
    font: FontRef<'static>,
}

impl<'a> Typeset<'a> {
    /// `bitmap` with text in `font`.
    pub(super) fn new(bitmap: BitMapBackend<'a>, font: FontRef<'static>) -> Self {
        Self { bitmap, font }
    }

    /// The glyphs of a line from the origin of its baseline, and its length [pixels].
    fn line(&self, text: &str, size: f64) -> (Vec<Glyph>, f32) {
        let em = (size * EM) as f32;
        let scale = PxScale::from(em * self.font.height_unscaled() / self.font.units_per_em().unwrap_or(1000.0));
        let font = self.font.as_scaled(scale);
        let (mut at, mut before, mut glyphs) = (0.0, None, vec![]);
        for c in text.chars() {
            let id = font.glyph_id(c);
            at += before.map_or(0.0, |before| font.kern(before, id));
            glyphs.push(id.with_scale_and_position(scale, point(at, 0.0)));
            at += font.h_advance(id);
            before = Some(id);
        }
        (glyphs, at)
    }
}

impl<'a> DrawingBackend for Typeset<'a> {
    type ErrorType = <BitMapBackend<'a> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.bitmap.get_size()
    }

    fn ensure_prepared(&mut self) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.bitmap.ensure_prepared()
    }

    fn present(&mut self) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.bitmap.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.bitmap.draw_pixel(point, color)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.bitmap.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        low: BackendCoord,
        high: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        self.bitmap.draw_rect(low, high, style, fill)
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        at: BackendCoord,
    ) -> Result<(), DrawingErrorKind<Self::ErrorType>> {
        let (glyphs, length) = self.line(text, style.size());
        let em = style.size() * EM;
        let across = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * f64::from(length),
            HPos::Right => -f64::from(length),
        };
        // Baselines as in the SVG, where 1 ex is about half an em.
        let down = match style.anchor().v_pos {
            VPos::Top => 0.76 * em,
            VPos::Center => 0.26 * em,
            VPos::Bottom => -0.26 * em,
        };
        let (across, down) = (across.round() as i32, down.round() as i32);
        let (turn, color, size): (FontTransform, _, _) = (style.transform(), style.color(), self.get_size());
        for outline in glyphs.into_iter().filter_map(|g| self.font.outline_glyph(g)) {
            let low = outline.px_bounds().min;
            let mut pixels = vec![];
            outline.draw(|x, y, coverage| pixels.push((low.x as i32 + x as i32, low.y as i32 + y as i32, coverage)));
            for (x, y, coverage) in pixels {
                let (x, y) = turn.transform(x + across, y + down);
                let (x, y) = (at.0 + x, at.1 + y);
                if x >= 0 && y >= 0 && x.cast_unsigned() < size.0 && y.cast_unsigned() < size.1 {
                    let alpha = color.alpha * f64::from(coverage.clamp(0.0, 1.0).powf(WEIGHT));
                    self.bitmap.draw_pixel((x, y), BackendColor { alpha, ..color })?;
                }
            }
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Self::ErrorType>> {
        Ok((self.line(text, style.size()).1.ceil() as u32, (style.size() * EM).ceil() as u32))
    }
}
