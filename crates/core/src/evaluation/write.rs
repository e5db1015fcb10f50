//! The table as text, Markdown, LaTeX and CSV.

use super::columns::{COLUMNS, Column, columns};
use super::{Difference, Estimate, Group, GroupDifference, Row, TableMetrics};

fn groups(rows: &[Row]) -> Vec<Group> {
    let mut groups: Vec<Group> =
        rows.iter().flat_map(|r| &r.groups).filter(|f| f.grasps > 0).map(|f| f.group).collect();
    groups.sort_unstable();
    groups.dedup();
    groups
}

fn of(row: &Row, group: Group) -> Option<&TableMetrics> {
    row.groups.iter().find(|f| f.group == group)
}

/// A figure without its interval; `-` for none.
fn number(estimate: Option<Estimate>, decimals: usize) -> String {
    estimate.map_or_else(|| "-".into(), |e| format!("{:.decimals$}", e.value))
}

fn with_interval(estimate: Option<Estimate>, decimals: usize) -> String {
    match estimate {
        Some(Estimate { value, interval: Some([low, high]) }) => {
            format!("{value:.decimals$} [{low:.decimals$} {high:.decimals$}]")
        }
        other => number(other, decimals),
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
        table(group, "method", &columns, &lines.collect::<Vec<_>>())
    };
    groups(rows).into_iter().map(of_group).collect()
}

/// The differences of methods, a table per column group, for people; empty without any.
pub fn differences_text(differences: &[Difference]) -> String {
    let all = || differences.iter().flat_map(|d| &d.groups);
    let columns: Vec<&Column> = COLUMNS.iter().filter(|c| all().any(|g| g.get(c).is_some())).collect();
    let mut groups: Vec<Group> = all().map(|g| g.group).collect();
    groups.sort_unstable();
    groups.dedup();
    let of_group = |group: Group| {
        let present =
            differences.iter().flat_map(|d| d.groups.iter().map(move |g| (d, g))).filter(|(_, g)| g.group == group);
        let lines = present.map(|(difference, figures): (&Difference, &GroupDifference)| Line {
            name: format!("{}, less {}", difference.to, difference.from),
            grasps: figures.grasps,
            cells: columns.iter().map(|c| with_interval(figures.get(c), c.decimals)).collect(),
        });
        table(group, "difference", &columns, &lines.collect::<Vec<_>>())
    };
    groups.into_iter().map(of_group).collect()
}

/// A line of a table for people.
struct Line {
    name: String,
    grasps: usize,
    cells: Vec<String>,
}

fn table(group: Group, first: &str, columns: &[&Column], lines: &[Line]) -> String {
    let name = lines.iter().map(|line| line.name.chars().count()).max().unwrap_or(0).max(first.len() + 2);
    let width = |i: usize| {
        let cells = lines.iter().map(|line| line.cells[i].chars().count());
        cells.max().unwrap_or(0).max(columns[i].heading.chars().count())
    };
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    let mut out = format!("{}\n  {first:<name$}  {:>6}", group.label(), "grasps");
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

/// One table with the column groups side by side, as the paper prints it.
pub fn markdown(rows: &[Row]) -> String {
    let (columns, groups) = (columns(rows), groups(rows));
    let mut out = String::from("| method |");
    let mut rule = String::from("|---|");
    for group in &groups {
        for column in &columns {
            out += &format!(" {}: {} |", group.short(), column.heading);
            rule.push_str("--:|");
        }
    }
    out += &format!("\n{rule}\n");
    for row in rows {
        let star = if row.published { " (published, real data)" } else { "" };
        out += &format!("| {}{star} |", row.method.replace('|', "/"));
        for group in &groups {
            for column in &columns {
                out += &format!(" {} |", number(of(row, *group).and_then(|f| f.get(column)), column.decimals));
            }
        }
        out.push('\n');
    }
    out
}

/// Text for LaTeX: what it takes for commands is escaped, signs that its fonts lack are written out.
fn tex(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '%' | '&' | '#' | '$' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '<' | '>' | '|' => out.push_str(&format!("${c}$")),
            '°' => out.push_str("$^\\circ$"),
            '≤' => out.push_str("$\\le$"),
            '–' | '—' => out.push_str("--"),
            c if c.is_ascii_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// The table in the paper's form as a LaTeX document that compiles by itself: its columns side by side for each group,
/// the best of what was computed here in bold. The lines between `tabular` can be taken into another document.
pub fn latex(rows: &[Row]) -> String {
    let columns: Vec<&Column> = columns(rows).into_iter().filter(|c| c.in_paper).collect();
    let groups = groups(rows);
    let mut out = String::from(
        "\\documentclass{article}\n\\usepackage[utf8]{inputenc}\n\\usepackage[T1]{fontenc}\n\
         \\usepackage[landscape,margin=1.5cm]{geometry}\n\\begin{document}\n\\pagestyle{empty}\n\\small\n\
         \\setlength{\\tabcolsep}{4pt}\n\\noindent\n",
    );
    out += &format!(
        "\\begin{{tabular}}{{l{}}}\n\\hline\n",
        format!("|{}", "r".repeat(columns.len())).repeat(groups.len())
    );
    for (i, group) in groups.iter().enumerate() {
        let side = if i + 1 < groups.len() { "c|" } else { "c" };
        out += &format!(" & \\multicolumn{{{}}}{{{side}}}{{{}}}", columns.len(), tex(group.label()));
    }
    out += " \\\\\nMethod";
    for column in groups.iter().flat_map(|_| &columns) {
        let arrow = if column.larger_is_better { "$\\uparrow$" } else { "$\\downarrow$" };
        out += &format!(" & {} {arrow}", tex(column.heading));
    }
    out += " \\\\\n\\hline\n";
    let figure = |row: &Row, group: Group, column: &Column| of(row, group).and_then(|f| f.get(column));
    let best = |group: Group, column: &Column| {
        let ours = rows.iter().filter(|row| !row.published && !row.upper_bound);
        let values = ours.filter_map(|row| figure(row, group, column)).map(|e| e.value).filter(|v| v.is_finite());
        let sign = if column.larger_is_better { 1.0 } else { -1.0 };
        values.max_by(|a, b| (sign * a).total_cmp(&(sign * b)))
    };
    for row in rows {
        out += &tex(&row.method);
        for (group, column) in groups.iter().flat_map(|group| columns.iter().map(move |column| (*group, *column))) {
            let estimate = figure(row, group, column);
            let text = number(estimate, column.decimals);
            let own = !row.published && !row.upper_bound;
            let bold = own && estimate.is_some_and(|e| Some(e.value) == best(group, column));
            out += &if bold { format!(" & \\textbf{{{text}}}") } else { format!(" & {text}") };
        }
        out += " \\\\\n";
    }
    out + "\\hline\n\\end{tabular}\n\\end{document}\n"
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
        let markdown = markdown(&rows);
        let lines: Vec<&str> = markdown.lines().collect();
        assert_eq!(lines.len(), 2 + rows.len());
        let bars = |line: &str| line.matches('|').count();
        assert!(lines.iter().all(|l| bars(l) == bars(lines[0])), "{markdown}");
        let latex = latex(&rows);
        let body: Vec<&str> = latex.lines().filter(|line| line.ends_with("\\\\")).collect();
        assert_eq!(body.len(), 2 + rows.len(), "{latex}");
        // Two groups of as many columns, in each line; the group's names span them.
        let cells = |line: &str| line.matches(" & ").count();
        assert!(body[1..].iter().all(|l| cells(l) == cells(body[1])) && cells(body[1]) % 2 == 0, "{latex}");
        assert!(body[0].contains(&format!("\\multicolumn{{{}}}", cells(body[1]) / 2)), "{latex}");
        assert!(
            body[2].starts_with("odd \"name\" $|$ with, signs & ") && latex.contains("$\\le$5$^\\circ$ \\%"),
            "{latex}"
        );
        // Braces close, and every bare percent sign would begin a comment.
        assert_eq!(latex.matches('{').count(), latex.matches('}').count());
        assert_eq!(latex.matches('%').count(), latex.matches("\\%").count());
        let csv = csv(&rows, 288);
        assert_eq!(csv.lines().count(), 1 + 2 * rows.len());
        assert!(csv.contains("\"odd \"\"name\"\" | with, signs\",true,unseen grasps,9,414,,828,0,26.1,,"), "{csv}");
        let commas = |line: &str| line.replace("with, signs", "").matches(',').count();
        assert!(csv.lines().all(|l| commas(l) == commas(csv.lines().next().unwrap())));
    }
}
