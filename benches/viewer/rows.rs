//! Scores of the lab's 32,256 pairs that were felt elsewhere: opened, listed, ordered, filtered.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use serde_json::json;
use touch2touch::app::command::{Command, LibraryCommand};
use touch2touch::app::evaluate::{EvaluateCommand, ScoreChoice};
use touch2touch::app::settings::{Workspace, prefer};
use touch2touch_core::evaluation::Metric;

use super::window::{Studio, own_ms};

/// Tools of the data set, and pairs of each.
const TOOLS: usize = 12;
const PAIRS: usize = 2688;

/// A folder of the lab's files, all of them empty: an index is made of names alone.
fn lab(root: &Path) -> std::io::Result<()> {
    for (sensor, prefix) in
        [("bubbles", "bubble_style_transfer_dataset_bubbles_"), ("gelslims", "gelslim_style_transfer_dataset_gelslim_")]
    {
        for tool in 0..TOOLS {
            let folder = root.join(format!("train/{sensor}/data/{prefix}pattern_{tool:02}"));
            std::fs::create_dir_all(&folder)?;
            for i in 0..PAIRS {
                File::create(folder.join(format!("data_{i}.pt")))?;
            }
        }
    }
    Ok(())
}

/// Writes a row for each pair.
fn write(file: &Path, names: &[String]) -> parquet::errors::Result<()> {
    const COLUMNS: [&str; 6] =
        ["error_rad", "true_angle_rad", "psnr_right_db", "psnr_left_db", "ssim_peak_right", "ssim_peak_left"];
    let numbers: String = COLUMNS.map(|name| format!("required double {name}; ")).concat();
    let texts = "required binary pair (UTF8); required binary recipe (UTF8); required binary verdict (UTF8);";
    let schema = Arc::new(parse_message_type(&format!("message rows {{ {texts} {numbers} }}"))?);
    let mut writer =
        SerializedFileWriter::new(File::create(file)?, schema, Arc::new(WriterProperties::builder().build()))?;
    let mut group = writer.next_row_group()?;
    let value = |column: usize, row: usize| {
        let wave = 0.5 + 0.5 * ((row * (column + 3)) as f64 * 0.618).sin();
        if column < 2 { 0.4 * wave } else { 20.0 * wave }
    };
    let mut column = 0;
    while let Some(mut next) = group.next_column()? {
        if column < 3 {
            let text = |name: &String| match column {
                0 => name.as_str().into(),
                1 => "r1-0123456789abcdef".into(),
                _ => "check".into(),
            };
            let texts: Vec<ByteArray> = names.iter().map(text).collect();
            next.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
        } else {
            let values: Vec<f64> = (0..names.len()).map(|row| value(column - 3, row)).collect();
            next.typed::<DoubleType>().write_batch(&values, None, None)?;
        }
        next.close()?;
        column += 1;
    }
    group.close()?;
    writer.close().map(drop)
}

/// Prints what rows of a whole data set cost; returns it for the file.
pub(super) fn rows() -> std::io::Result<serde_json::Value> {
    let folder = tempfile::tempdir()?;
    lab(folder.path())?;
    let mut studio = Studio::on(Some(folder.path().to_owned()), false, false)?;
    let wait = |studio: &mut Studio, done: &dyn Fn(&Studio) -> bool| {
        let begin = Instant::now();
        while !done(studio) && begin.elapsed().as_secs() < 120 {
            studio.frame(&[]);
        }
        begin.elapsed().as_secs_f64() * 1e3
    };
    wait(&mut studio, &|studio| studio.harness.state().state().library.pairs().len() == TOOLS * PAIRS);
    studio.harness.state_mut().push(prefer(|s| s.hint_dismissed = true));
    studio.harness.state_mut().push(prefer(|s| s.workspace = Workspace::Evaluate));
    for _ in 0..10 {
        studio.frame(&[]);
    }
    let names: Vec<String> =
        studio.harness.state().state().library.pairs().iter().map(|entry| entry.name.clone()).collect();
    let file = folder.path().join("rows.parquet");
    write(&file, &names).map_err(std::io::Error::other)?;
    studio.harness.state_mut().push(Command::Evaluate(EvaluateCommand::OpenRows(file)));
    let scored = |studio: &Studio| studio.harness.state().state().table.scores.sources.iter().any(|s| s.scored > 0);
    let shown = wait(&mut studio, &scored);
    let choice = |metric| ScoreChoice { metric: Some(metric), ..studio.harness.state().state().table.chosen.clone() };
    let commands: [(&str, Command); 3] = [
        ("ordered by PSNR", LibraryCommand::SetScore(choice(Metric::Psnr)).into()),
        ("ordered by angle", LibraryCommand::SetScore(choice(Metric::Angle)).into()),
        ("filtered: angle>5 psnr<20", LibraryCommand::SetFilter("angle>5 psnr<20".into()).into()),
    ];
    println!("\n{} pairs with scores by rows, of which {shown:.0} ms after they were asked for", names.len());
    let mut took = serde_json::Map::new();
    for (name, command) in commands {
        studio.harness.state_mut().push(command);
        let begin = own_ms();
        studio.frame(&[]);
        let ms = own_ms() - begin;
        println!(
            "{name:>28}: {ms:.1} ms with its frame, {} listed",
            studio.harness.state().state().library.order.len()
        );
        took.insert(name.into(), ms.into());
    }
    Ok(json!({ "pairs": names.len(), "shown_ms": shown, "ms": took }))
}
