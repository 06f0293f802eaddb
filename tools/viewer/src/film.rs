//! Pictures as PNG, several as an animated PNG: each frame has what differs from the one before.

use std::fs::File;
use std::io::{BufWriter, Result};
use std::path::Path;

use png::{BitDepth, BlendOp, ColorType, Compression, Encoder};

use crate::render::Picture;

pub fn still(picture: &Picture, path: &Path) -> Result<()> {
    let mut encoder = Encoder::new(BufWriter::new(File::create(path)?), picture.size[0], picture.size[1]);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.write_header()?.write_image_data(picture.pixels.as_flattened())?;
    Ok(())
}

/// Writes frames that are shown for `delay` [ms] each, for ever.
pub fn film(pictures: &[Picture], delay: u16, path: &Path) -> Result<()> {
    let Some(first) = pictures.first() else { return Ok(()) };
    let mut encoder = Encoder::new(BufWriter::new(File::create(path)?), first.size[0], first.size[1]);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::High);
    encoder.set_animated(pictures.len() as u32, 0)?;
    encoder.set_frame_delay(delay, 1000)?;
    encoder.set_blend_op(BlendOp::Over)?;
    let mut writer = encoder.write_header()?;
    for (index, picture) in pictures.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| &pictures[before].pixels);
        let pixel = |(at, [r, g, b]): (usize, &[u8; 3])| match before {
            Some(before) if before[at] == [*r, *g, *b] => [0; 4],
            _ => [*r, *g, *b, 255],
        };
        let data: Vec<[u8; 4]> = picture.pixels.iter().enumerate().map(pixel).collect();
        writer.write_image_data(data.as_flattened())?;
    }
    writer.finish()?;
    Ok(())
}
