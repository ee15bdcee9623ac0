//! A painting as a PNG of 256 colours, a third of the bytes of one of all colours. Charts hold few colours
//! but for the rims of letters and lines, which lie between two of them.

use std::collections::HashMap;

/// Red, green and blue.
type Color = [u8; 3];

/// Colours of a palette that a byte can name.
const PALETTE: usize = 256;

/// The PNG of `pixels`, rows of red, green and blue from the top. Colours beyond the most frequent 256 become
/// the nearest of those.
pub(super) fn encode(pixels: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, png::EncodingError> {
    let (palette, indices) = index(pixels);
    let mut bytes = vec![];
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.concat());
    encoder.set_compression(png::Compression::High);
    // Neighbouring indices say nothing of each other: a filter of differences would only blur what repeats.
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&indices)?;
    writer.finish()?;
    Ok(bytes)
}

/// The most frequent colours, and which of them each pixel is nearest to.
fn index(pixels: &[u8]) -> (Vec<Color>, Vec<u8>) {
    let colors = || pixels.chunks_exact(3).map(|c| [c[0], c[1], c[2]]);
    let mut counts: HashMap<Color, usize> = HashMap::new();
    colors().for_each(|color| *counts.entry(color).or_default() += 1);
    let mut palette: Vec<Color> = counts.keys().copied().collect();
    // By colour where counts are equal: the same painting is the same file.
    palette.sort_by_key(|color| (std::cmp::Reverse(counts[color]), *color));
    palette.truncate(PALETTE);

    let distance = |a: Color, b: Color| (0..3).map(|i| a[i].abs_diff(b[i]) as u32 * a[i].abs_diff(b[i]) as u32).sum::<u32>();
    let nearest = |color: Color| (0..palette.len()).min_by_key(|&i| distance(palette[i], color)).unwrap_or(0) as u8;
    let indices: HashMap<Color, u8> = counts.keys().map(|&color| (color, nearest(color))).collect();
    let pixels = colors().map(|color| indices[&color]).collect();
    (palette, pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Few colours stay as they are; of more than a palette holds the rare ones become their nearest.
    #[test]
    fn rare_colors_become_their_nearest() {
        let few = [[9, 8, 7], [1, 2, 3], [9, 8, 7]].concat();
        let (palette, indices) = index(&few);
        assert_eq!((palette, indices), (vec![[9, 8, 7], [1, 2, 3]], vec![0, 1, 0]));

        let often = (0..=255).flat_map(|gray| [[gray; 3]; 2].concat());
        let many: Vec<u8> = often.chain([100, 100, 103]).collect();
        let (palette, indices) = index(&many);
        assert_eq!((palette.len(), palette[*indices.last().expect("a pixel") as usize]), (256, [101; 3]));
        assert!(many.chunks_exact(6).zip(indices.chunks_exact(2)).all(|(c, i)| palette[i[1] as usize] == c[3..]));
    }
}
