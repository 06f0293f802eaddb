//! The C header is what cbindgen makes of src/capi today. `ISOCOAT_UPDATE_HEADER=1 cargo test --test header` writes it.

use std::fs;
use std::path::Path;

/// The sources of the header, in the order of its parts.
const SOURCES: &[&str] = &[
    "status", "version", "handle", "math", "guard", "world", "body", "link", "skeleton", "motion", "buffer", "bulk",
    "report",
];

fn fill_in(text: Option<String>) -> Option<String> {
    let fill = |text: String| {
        text.replace("@MAJOR@", env!("CARGO_PKG_VERSION_MAJOR"))
            .replace("@MINOR@", env!("CARGO_PKG_VERSION_MINOR"))
            .replace("@PATCH@", env!("CARGO_PKG_VERSION_PATCH"))
    };
    text.map(|text| fill(text).trim().to_owned())
}

fn generate(root: &Path) -> String {
    let mut config = cbindgen::Config::from_file(root.join("cbindgen.toml")).expect("cbindgen.toml is valid");
    config.header = fill_in(config.header);
    config.after_includes = fill_in(config.after_includes);
    config.trailer = fill_in(config.trailer);
    let mut builder = cbindgen::Builder::new().with_config(config);
    for source in SOURCES {
        builder = builder.with_src(root.join("src/capi").join(source).with_extension("rs"));
    }
    let mut header = Vec::new();
    builder.generate().expect("cbindgen understands src/capi").write(&mut header);
    String::from_utf8(header).expect("UTF-8")
}

#[test]
fn the_header_is_up_to_date() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("include/isocoat/isocoat.h");
    let generated = generate(root);
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

/// Every source of the C API with something to export is among [`SOURCES`].
#[test]
fn no_source_is_forgotten() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/capi");
    for entry in fs::read_dir(root).expect("src/capi exists") {
        let path = entry.expect("readable").path();
        let name = path.file_stem().expect("has a name").to_string_lossy().into_owned();
        let text = fs::read_to_string(&path).expect("readable");
        let exports =
            ["#[unsafe(no_mangle)]", "#[repr(C)]", "pub const ISOCOAT_"].iter().any(|mark| text.contains(mark));
        assert!(!exports || SOURCES.contains(&name.as_str()), "tests/header.rs: SOURCES lacks {name}");
    }
}
