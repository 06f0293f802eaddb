//! The C header is what cbindgen makes of src/capi today. `ISOCOAT_UPDATE_HEADER=1 cargo test --test header` writes it.
//!
//! Each source becomes one section: cbindgen renders it on its own, and its blocks are put in the order in which a
//! person reads them. The text round the sections stands in cbindgen.toml.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// The sources of the header, in the order of its sections, with their titles.
const SECTIONS: &[(&str, &str)] = &[
    ("status", "Status"),
    ("version", "Version"),
    ("handle", "Handles"),
    ("math", "Poses, wrenches, inertia"),
    ("guard", "World"),
    ("world", ""),
    ("body", "Bodies"),
    ("link", "Links"),
    ("skeleton", "Skeletons"),
    ("blend", "Blend graphs"),
    ("spring", "Springs"),
    ("motion", "Motion of one link"),
    ("buffer", "Bulk calls"),
    ("bulk", ""),
    ("articulation", "Articulations"),
    ("tasks", "Threads of the host"),
    ("report", "What a step reports"),
    ("snapshot", "Snapshots"),
    ("recording", "Recordings"),
    ("query", "Queries"),
    ("rays", ""),
    ("mesh", "Meshes"),
    ("skin", "Skins"),
    ("fit", "Coats from meshes"),
    ("volume", "Volumes"),
    ("substance", "Substances"),
    ("particle", ""),
    ("piece", ""),
    ("draw", "Debug drawing"),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn fill_in(text: Option<String>) -> String {
    text.unwrap_or_default()
        .replace("@MAJOR@", env!("CARGO_PKG_VERSION_MAJOR"))
        .replace("@MINOR@", env!("CARGO_PKG_VERSION_MINOR"))
        .replace("@PATCH@", env!("CARGO_PKG_VERSION_PATCH"))
        .trim()
        .to_owned()
}

/// The word after `keyword` in each line of a source that begins with it.
fn names<'a>(source: &'a str, keyword: &'a str) -> impl Iterator<Item = &'a str> {
    let word = |rest: &'a str| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next();
    source.lines().filter_map(move |line| line.strip_prefix(keyword).and_then(word))
}

/// A comment of one line on one line, no empty lines at the end of comments, no `struct` before type names, unsigned
/// constants.
fn tidy(block: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for line in block.lines() {
        // What stands round the notes to cbindgen, so that rustdoc does not show them.
        if ["* <!--", "* -->"].contains(&line.trim()) {
            continue;
        }
        if line.trim() == "*/" {
            while lines.last().is_some_and(|last| last.trim() == "*") {
                lines.pop();
            }
            if let [.., open, text] = &lines[..]
                && open.trim() == "/**"
            {
                let one = format!("{open} {} */", text.trim().trim_start_matches("* "));
                if one.len() <= 120 {
                    lines.truncate(lines.len() - 2);
                    lines.push(one);
                    continue;
                }
            }
        }
        lines.push(match line.strip_prefix("#define ") {
            Some(constant) => format!("#define {constant}u"),
            None if line.starts_with("typedef struct ") => line.to_owned(),
            None => line.replace("struct isocoat_", "isocoat_"),
        });
    }
    lines.join("\n")
}

/// One source as C: its types, each followed by its constants, then its functions.
fn section(config: &cbindgen::Config, file: &Path) -> String {
    let source = fs::read_to_string(file).expect("readable");
    let mut config = config.clone();
    let types = names(&source, "pub struct ").chain(names(&source, "pub type "));
    config.export.include = types.filter(|name| name.starts_with("isocoat_")).map(str::to_owned).collect();
    let mut text = Vec::new();
    let builder = cbindgen::Builder::new().with_config(config).with_src(file);
    builder.generate().expect("cbindgen understands src/capi").write(&mut text);
    let text = String::from_utf8(text).expect("UTF-8");

    let blocks = text.trim().split("\n\n").map(|block| tidy(block.trim_matches('\n')));
    let (constants, others): (Vec<_>, Vec<_>) = blocks.partition(|block| block.contains("#define "));
    let mut out = String::new();
    let mut placed = 0;
    for block in others {
        writeln!(out, "{block}\n").expect("strings take all");
        let alias = block.rsplit(' ').next().and_then(|last| last.strip_suffix(';'));
        let (true, Some(alias)) = (block.contains("typedef uint32_t"), alias) else { continue };
        for constant in &constants {
            let define = constant.lines().last().unwrap_or_default();
            let name = define.split(' ').nth(1).unwrap_or_default();
            if source.contains(&format!("pub const {name}: {alias} =")) {
                writeln!(out, "{constant}").expect("strings take all");
                placed += 1;
            }
        }
        out.push('\n');
    }
    assert_eq!(placed, constants.len(), "{}: a constant whose type is not defined in the file", file.display());
    out.replace("\n\n\n", "\n\n")
}

fn generate() -> String {
    let mut config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml is valid");
    let [header, top, bottom] =
        [config.header.take(), config.after_includes.take(), config.trailer.take()].map(fill_in);
    let mut out = format!("{header}\n\n{top}\n");
    for (source, title) in SECTIONS {
        if !title.is_empty() {
            let rule = "-".repeat(108 - title.len());
            write!(out, "\n/* ---- {title} {rule} */\n").expect("strings take all");
        }
        let text = section(&config, &root().join("src/capi").join(source).with_extension("rs"));
        write!(out, "\n{}\n", text.trim()).expect("strings take all");
    }
    write!(out, "\n{bottom}\n").expect("strings take all");
    out
}

#[test]
fn the_header_is_up_to_date() {
    let path = root().join("include/isocoat/isocoat.h");
    let generated = generate();
    if std::env::var_os("ISOCOAT_UPDATE_HEADER").is_some() {
        fs::create_dir_all(path.parent().expect("has a parent")).expect("include/isocoat can be created");
        fs::write(&path, generated).expect("the header can be written");
        return;
    }
    let checked_in = fs::read_to_string(&path).unwrap_or_default();
    let first = generated.lines().zip(checked_in.lines()).position(|(new, old)| new != old);
    let line = first.unwrap_or_else(|| generated.lines().count().min(checked_in.lines().count()));
    assert!(
        generated == checked_in,
        "include/isocoat/isocoat.h differs from src/capi and cbindgen.toml, first in line {}:\n  checked in: {}\n  \
         generated:  {}\nRun `ISOCOAT_UPDATE_HEADER=1 cargo test --test header`, and look at the difference.",
        line + 1,
        checked_in.lines().nth(line).unwrap_or("(end)"),
        generated.lines().nth(line).unwrap_or("(end)"),
    );
}

#[test]
fn no_source_and_no_function_is_forgotten() {
    let header = generate();
    for entry in fs::read_dir(root().join("src/capi")).expect("src/capi exists") {
        let path = entry.expect("readable").path();
        let name = path.file_stem().expect("has a name").to_string_lossy().into_owned();
        let source = fs::read_to_string(&path).expect("readable");
        let functions = names(&source, "pub unsafe extern \"C\" fn ").chain(names(&source, "pub extern \"C\" fn "));
        let items = functions.chain(names(&source, "pub struct ")).chain(names(&source, "pub type "));
        for item in items.chain(names(&source, "pub const ")).filter(|item| item.to_lowercase().starts_with("isocoat"))
        {
            assert!(SECTIONS.iter().any(|(section, _)| *section == name), "tests/header.rs: SECTIONS lacks {name}");
            assert!(header.contains(item), "{item} of src/capi/{name}.rs is not in the header");
        }
    }
    assert!(!header.contains("# Safety") && !header.contains("cbindgen:"), "notes for Rust have come into the header");
    let long = header.lines().find(|line| line.len() > 120);
    assert_eq!(long, None, "a line of the header is longer than 120 columns");
}
