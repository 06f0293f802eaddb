//! Gives the shared library the name it is looked up by at run time: plain cargo sets none.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let part = |name: &str| env::var(format!("CARGO_PKG_VERSION_{name}")).expect("cargo sets the version");
    // Before 1.0 a new minor version may break hosts, from then on a new major one.
    let abi = match (part("MAJOR").as_str(), part("MINOR")) {
        ("0", minor) => format!("0.{minor}"),
        (major, _) => major.to_owned(),
    };
    match env::var("CARGO_CFG_TARGET_OS").expect("cargo sets the target").as_str() {
        "linux" => println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libisocoat.so.{abi}"),
        "macos" => println!("cargo::rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libisocoat.{abi}.dylib"),
        _ => {}
    }
}
