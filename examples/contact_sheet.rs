//! Writes a sheet of simulated tiles in the form of the published ones (128 x 128, difference images
//! standardised, imprints scaled image by image and rotated by 180 degrees), to compare with real ones by eye.
//!
//! `cargo run --release --no-default-features --example contact_sheet -- [OUT.png [PER_TOOL [SEED [SENSOR]]]]`
//!
//! Columns are tools in the order of `catalog::tools()`, six to a row; values are rounded to [`STEP`] so that the noise
//! does not fill the repository.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{Rgb, RgbImage};
use touch2touch_core::catalog;
use touch2touch_core::rig::lab;
use touch2touch_core::sim;

const TILE: u32 = 128;
const GAP: u32 = 3;
const COLUMNS: u32 = 6;
/// Gray levels per step of the written values.
const STEP: f32 = 6.0;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "docs/simulated_tiles.png".to_owned());
    let per_tool: u32 = arguments.next().map_or(Ok(1), |n| n.parse())?;
    let seed: u64 = arguments.next().map_or(Ok(1), |n| n.parse())?;
    let sensor: Option<u64> = arguments.next().map(|n| n.parse()).transpose()?;
    let config = sensor.map_or_else(sim::SimConfig::default, sim::SimConfig::randomised);

    let tools = catalog::tools();
    let count = tools.len() as u32 * per_tool;
    let rows = count.div_ceil(COLUMNS);
    let mut sheet = RgbImage::from_pixel(COLUMNS * (TILE + GAP), 2 * rows * (TILE + GAP), Rgb([255; 3]));
    for n in 0..count {
        let tool = &tools[(n / per_tool) as usize];
        let number = seed * 1000 + u64::from(n);
        let sample = sim::simulate(tool, sim::random_grasp(number), number, &config);
        let Some(touch) = sample.pad(lab::PADS[n as usize % 2]) else {
            continue;
        };
        let (column, row) = (n % COLUMNS, n / COLUMNS);
        if let Some(gelslim) = touch.color() {
            let image = &gelslim.difference;
            let tile = resample(image.width(), image.height(), |x, y| image[(x, y)]);
            put(&mut sheet, column, row, &scaled(&tile));
        }
        if let Some(bubble) = touch.depth() {
            let image = bubble.imprint.rotated_180();
            let tile = resample(image.width(), image.height(), |x, y| [image[(x, y)]; 3]);
            put(&mut sheet, column, rows + row, &scaled(&tile));
        }
    }
    let file = std::io::BufWriter::new(std::fs::File::create(&path)?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    sheet.write_with_encoder(encoder)?;
    Ok(())
}

/// Bilinear to 128 x 128 without antialiasing, as the lab's loader does.
fn resample(width: usize, height: usize, at: impl Fn(usize, usize) -> [f32; 3]) -> Vec<[f32; 3]> {
    let axis = |i: u32, n: usize| {
        let x = ((i as f32 + 0.5) * n as f32 / TILE as f32 - 0.5).clamp(0.0, (n - 1) as f32);
        let lo = (x as usize).min(n - 2);
        (lo, x - lo as f32)
    };
    let mut out = Vec::with_capacity((TILE * TILE) as usize);
    for row in 0..TILE {
        let (y, ty) = axis(row, height);
        for column in 0..TILE {
            let (x, tx) = axis(column, width);
            let (a, b, c, d) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
            out.push(std::array::from_fn(|k| {
                (a[k] * (1.0 - tx) + b[k] * tx) * (1.0 - ty) + (c[k] * (1.0 - tx) + d[k] * tx) * ty
            }));
        }
    }
    out
}

/// Every tile is stretched to its own range, over all channels together after standardising each.
fn scaled(tile: &[[f32; 3]]) -> Vec<[u8; 3]> {
    // the deviations that the lab standardises by matter only relative to each other
    let deviation = [0.0989, 0.0746, 0.0731];
    let gray = tile.iter().all(|p| p[0] == p[1] && p[1] == p[2]);
    let value = |p: &[f32; 3], c: usize| if gray { p[c] } else { p[c] / deviation[c] };
    let all = || tile.iter().flat_map(|p| (0..3).map(move |c| value(p, c)));
    let (lo, hi) = all().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let level = |v: f32| (((v - lo) / (hi - lo).max(1e-9) * 255.0 / STEP).round() * STEP) as u8;
    tile.iter().map(|p| std::array::from_fn(|c| level(value(p, c)))).collect()
}

fn put(sheet: &mut RgbImage, column: u32, row: u32, tile: &[[u8; 3]]) {
    for (i, pixel) in tile.iter().enumerate() {
        let (x, y) = (i as u32 % TILE, i as u32 / TILE);
        sheet.put_pixel(column * (TILE + GAP) + x, row * (TILE + GAP) + y, Rgb(*pixel));
    }
}
