//! The table as text and CSV.

use std::collections::BTreeSet;

use super::columns::{COLUMNS, Column, columns};
use super::{Estimate, Group, Row, TableMetrics};

fn of(row: &Row, group: Group) -> Option<&TableMetrics> {
    row.groups.iter().find(|f| f.group == group)
}

/// A figure and its interval where it has one; `-` for none.
fn with_interval(estimate: Option<Estimate>, decimals: usize) -> String {
    match estimate {
        Some(Estimate { value, interval: Some([low, high]) }) => {
            format!("{value:.decimals$} [{low:.decimals$} {high:.decimals$}]")
        }
        Some(Estimate { value, interval: None }) => format!("{value:.decimals$}"),
        None => "-".into(),
    }
}

/// A table per column group, for people.
pub fn text(rows: &[Row]) -> String {
    let columns = columns(rows);
    let of_group = |group: Group| {
        let present = rows.iter().filter_map(|r| Some((r, of(r, group)?)));
        let lines = present.map(|(row, figures)| Line {
            name: row.method.clone(),
            grasps: figures.grasps,
            cells: columns.iter().map(|c| with_interval(figures.get(c), c.decimals)).collect(),
        });
        table(group, &columns, &lines.collect::<Vec<_>>())
    };
    let figures = rows.iter().flat_map(|row| &row.groups).filter(|figures| figures.grasps > 0);
    let groups: BTreeSet<Group> = figures.map(|figures| figures.group).collect();
    groups.into_iter().map(of_group).collect()
}

/// A line of a table for people.
struct Line {
    name: String,
    grasps: usize,
    cells: Vec<String>,
}

fn table(group: Group, columns: &[&Column], lines: &[Line]) -> String {
    let name = lines.iter().map(|line| line.name.chars().count()).max().unwrap_or(0).max(8);
    let width = |i: usize| {
        let cells = lines.iter().map(|line| line.cells[i].chars().count());
        cells.max().unwrap_or(0).max(columns[i].heading.chars().count())
    };
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    let mut out = format!("{}\n  {:<name$}  {:>6}", group.label(), "method", "grasps");
    for (column, width) in columns.iter().zip(&widths) {
        out += &format!("  {:>width$}", column.heading);
    }
    out.push('\n');
    for line in lines {
        out += &format!("  {:<name$}  {:>6}", line.name, line.grasps);
        for (cell, width) in line.cells.iter().zip(&widths) {
            out += &format!("  {cell:>width$}");
        }
        out.push('\n');
    }
    out.push('\n');
    out
}

/// One line per method and column group with every figure and its interval.
pub fn csv(rows: &[Row], of: usize) -> String {
    let mut out = String::from("method,published,group,tools,grasps,data_set_pairs,images,without_pose");
    for name in COLUMNS.iter().map(|c| c.key) {
        out += &format!(",{name},{name}_low,{name}_high");
    }
    out.push('\n');
    for row in rows {
        for f in row.groups.iter().filter(|f| f.grasps > 0) {
            let method = row.method.replace('"', "\"\"");
            let group = f.group.short();
            let of = if row.published { String::new() } else { of.to_string() };
            out += &format!(
                "\"{method}\",{},{group},{},{},{of},{},{}",
                row.published, f.tools, f.grasps, f.images, f.without_pose
            );
            for column in COLUMNS {
                let estimate = f.get(column);
                let text = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
                let interval = estimate.and_then(|e| e.interval);
                out += &format!(
                    ",{},{},{}",
                    text(estimate.map(|e| e.value)),
                    text(interval.map(|i| i[0])),
                    text(interval.map(|i| i[1]))
                );
            }
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::paper_rows;
    use super::*;

    #[test]
    fn every_form_holds_every_row_and_leaves_out_empty_columns() {
        let mut rows = paper_rows();
        rows[0].method = "odd \"name\" | with, signs".into();
        let text = text(&rows);
        assert!(text.contains("Unseen tools") && text.contains("20.4") && !text.contains("IoU"), "{text}");
        let csv = csv(&rows, 288);
        assert_eq!(csv.lines().count(), 1 + 2 * rows.len());
        assert!(csv.contains("\"odd \"\"name\"\" | with, signs\",true,unseen grasps,9,414,,828,0,26.1,,"), "{csv}");
        let commas = |line: &str| line.replace("with, signs", "").matches(',').count();
        assert!(csv.lines().all(|l| commas(l) == commas(csv.lines().next().unwrap())));
    }
}
