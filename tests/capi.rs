//! The C API from outside: the header in every language mode, the C and C++ programs of tests/c and the C example,
//! layouts as C and Rust see them, and the frozen lists of constants and functions.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use isocoat::capi::{
    body, buffer, draw, fit, handle, link, math, mesh, motion, piece, query, rays, recording, report, skeleton, spring,
    substance, world,
};

const WARNINGS: &[&str] =
    &["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Wsign-conversion", "-Werror", "-O1", "-g"];

/// What a static Rust library needs from the system.
const SYSTEM: &[&str] = if cfg!(target_os = "linux") {
    &["-lgcc_s", "-lutil", "-lrt", "-lpthread", "-lm", "-ldl", "-lc"]
} else {
    &["-lm", "-lc"]
};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A folder for what a test builds.
fn scratch(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("capi").join(test);
    fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

/// The static library that cargo has built for these tests.
fn library() -> PathBuf {
    let program = std::env::current_exe().expect("known");
    let library = program.with_file_name("libisocoat.a");
    assert!(library.exists(), "{} is missing: Cargo.toml must list staticlib", library.display());
    library
}

/// The compiler that the cc crate finds, for C or C++ of a standard.
fn compiler(standard: &str) -> Command {
    let version = Command::new("rustc").arg("-vV").output().expect("rustc runs").stdout;
    let version = String::from_utf8(version).expect("UTF-8");
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc names its host");
    let mut build = cc::Build::new();
    build.cpp(standard.contains("++")).target(host).host(host).opt_level(0).cargo_metadata(false);
    let mut command = build.get_compiler().to_command();
    command.arg(format!("-std={standard}")).args(WARNINGS).arg("-I").arg(root().join("include"));
    command
}

fn run(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{command:?}\n{}\n{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

/// Builds a program of some sources, and runs it.
fn build_and_run(test: &str, standard: &str, sources: &[&Path]) -> String {
    let name = sources[0].file_stem().expect("has a name").to_string_lossy().into_owned();
    let program = scratch(test).join(format!("{name}-{standard}"));
    let mut command = compiler(standard);
    if standard.contains("++") {
        command.args(["-x", "c++"]);
    }
    run(command.args(sources).args(["-x", "none"]).arg(library()).arg("-o").arg(&program).args(SYSTEM));
    run(&mut Command::new(program))
}

/// Two translation units that include the header, one of them twice, link and agree, in every mode.
#[test]
fn the_header_is_c99_and_cpp11_and_later() {
    let folder = scratch("modes");
    let (first, second) = (folder.join("first.c"), folder.join("second.c"));
    let own = "static int own(void)\n{\n    const isocoat_world_desc desc = isocoat_world_desc_default();\n    \
               return isocoat_check_abi() == ISOCOAT_OK && desc.struct_size == sizeof desc;\n}\n";
    let include = "#include <isocoat/isocoat.h>\n";
    let other = "int other(void);\n";
    fs::write(
        &first,
        format!("{include}{include}{other}{own}int main(void)\n{{\n    return !(own() && other());\n}}\n"),
    )
    .expect("writable");
    fs::write(&second, format!("{include}{other}{own}int other(void)\n{{\n    return own();\n}}\n")).expect("writable");
    for standard in ["c99", "c11", "c17", "c++11", "c++14", "c++17", "c++20"] {
        build_and_run("modes", standard, &[&first, &second]);
    }
}

#[test]
fn the_cpp_wrapper_holds() {
    let wrapper = root().join("tests/c/wrapper.cpp");
    for standard in ["c++17", "c++20"] {
        assert!(build_and_run("wrapper", standard, &[&wrapper]).contains("all checks hold"));
    }
}

#[test]
fn the_c_programs_hold() {
    let mut count = 0;
    for entry in fs::read_dir(root().join("tests/c")).expect("tests/c exists") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|extension| extension == "c") {
            assert!(build_and_run("programs", "c99", &[&path]).contains("all checks hold"), "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 6, "tests/c has lost programs: only {count} are left");
}

/// As C it is the product; that it is C++ too is what a host may hope for.
#[test]
fn the_example_bounces() {
    let example = root().join("examples/c/two_balls.c");
    for standard in ["c99", "c++11"] {
        assert!(build_and_run("example", standard, &[&example]).contains("bounces"));
    }
}

/// Size of a struct and offset of each field.
type Layout = (usize, BTreeMap<&'static str, usize>);

macro_rules! layouts {
    ($($module:ident::$name:ident { $($field:ident),+ $(,)? })+) => {
        BTreeMap::from([$((
            stringify!($name),
            (
                size_of::<$module::$name>(),
                BTreeMap::from([$((stringify!($field), std::mem::offset_of!($module::$name, $field))),+]),
            ),
        )),+])
    };
}

fn rust_layouts() -> BTreeMap<&'static str, Layout> {
    layouts! {
        handle::isocoat_body { index, generation, world }
        handle::isocoat_link { index, generation, world }
        handle::isocoat_skeleton { index, generation, world }
        handle::isocoat_spring { index, generation, world }
        math::isocoat_pose { position, orientation }
        math::isocoat_wrench { force, torque }
        motion::isocoat_link_state { pose, linear_velocity, angular_velocity }
        buffer::isocoat_buffer { data, stride, format }
        world::isocoat_world_desc {
            struct_size, response, scheme, seed_count, max_substeps, gravity, force_tolerance, substep_phase, implicit_tolerance,
            implicit_rounds, implicit_splits, sleep_time, sleep_speed, timed, reserved,
        }
        body::isocoat_body_desc {
            struct_size, kind, isovalue, stiffness_scale, friction, static_friction, viscous_friction, dissipation,
            category, mask, user_data, response, stiffness_rule, static_sink, contact_frequency, damping_ratio,
            may_sleep, reserved, blend_band, self_contact, reserved_2, volume_gain, bulge_width, bulge_height,
        }
        link::isocoat_link_desc {
            struct_size, kind, pose, linear_velocity, angular_velocity, mass, local_center_of_mass, inertia,
            gravity_scale, external_acceleration, external_angular_acceleration, velocity_convention, flags,
            inverse_effective_inertia, user_data,
        }
        skeleton::isocoat_skeleton_desc {
            struct_size, shape, points, thickness, stiffness, stiffening, radius, seed_count, user_data,
        }
        spring::isocoat_spring_desc {
            struct_size, reserved, links, points, rest_length, stiffness, damping, user_data,
        }
        spring::isocoat_spring_state { length, rate, tension, energy }
        report::isocoat_contact {
            body_a, body_b, link_a, link_b, skeleton_a, skeleton_b, position, normal, force, torque, area,
            peak_pressure, stiffness, error_estimate, evaluations, scheme, overloaded, reserved,
        }
        report::isocoat_event { kind, reserved, body_a, body_b }
        report::isocoat_counters {
            struct_size, bodies, links, skeletons, pairs, islands, substeps, patches, evaluations,
            implicit_rounds, implicit_splits, evaluations_by_scheme, patches_by_scheme, asleep, reserved,
        }
        report::isocoat_times {
            struct_size, reserved, step, begin, pairs, islands, respond, contact, solve, report, substances,
        }
        substance::isocoat_substance_desc {
            struct_size, seed_count, spacing, particle_mass, cohesion, viscosity, damping, fusion_threshold, blend_time,
            volume_gain, thickness, radius,
        }
        piece::isocoat_piece {
            mass, volume, center, momentum, angular_momentum, particle_count, reserved,
        }
        piece::isocoat_change { kind, reserved, body, particle_count, first_particle }
        query::isocoat_ray_hit { body, link, skeleton, distance, position, normal }
        query::isocoat_surface_point { position, normal, distance, link, skeleton }
        handle::isocoat_skin { index, generation, world }
        buffer::isocoat_const_buffer { data, stride, format }
        rays::isocoat_rays_desc { struct_size, deformation, goal, reserved, mask, max_distance }
        rays::isocoat_ray_hits {
            struct_size, reserved, distances, positions, normals, bodies, links, skeletons,
        }
        mesh::isocoat_mesh_desc { struct_size, deformation, cell_size, attributes, reserved }
        mesh::isocoat_mesh_view { positions, normals, triangles, valid, vertex_count, triangle_count }
        fit::isocoat_fit_desc { struct_size, shape, count, reserved, width }
        fit::isocoat_fit_distance { mean, maximum, diagonal }
        recording::isocoat_recorder_desc { struct_size, key_interval, context, write }
        draw::isocoat_debug_draw { struct_size, flags, context, draw_line, draw_point }
    }
}

fn header() -> String {
    fs::read_to_string(root().join("include/isocoat/isocoat.h")).expect("the header is there")
}

/// The structs of the header and their fields, in order.
fn header_structs(header: &str) -> Vec<(String, Vec<String>)> {
    let mut structs = Vec::new();
    let mut lines = header.lines();
    while let Some(line) = lines.next() {
        let Some(name) = line.strip_prefix("typedef struct ").and_then(|rest| rest.strip_suffix(" {")) else {
            continue;
        };
        let declarations = lines.by_ref().take_while(|line| !line.starts_with('}')).map(str::trim);
        let fields = declarations.filter(|line| line.ends_with(';')).map(|line| {
            let declared = line.split(['[', ';']).next().unwrap_or_default();
            declared.rsplit([' ', '*']).next().unwrap_or_default().to_owned()
        });
        structs.push((name.to_owned(), fields.collect()));
    }
    structs
}

#[test]
fn layouts_are_the_same_in_c_and_in_rust() {
    let structs = header_structs(&header());
    let mut program = String::from("#include <isocoat/isocoat.h>\n#include <stdio.h>\n\nint main(void)\n{\n");
    for (name, fields) in &structs {
        program += &format!("    printf(\"{name} %u\\n\", (unsigned)sizeof({name}));\n");
        for field in fields {
            program += &format!("    printf(\"{name}.{field} %u\\n\", (unsigned)offsetof({name}, {field}));\n");
        }
    }
    program += "    return 0;\n}\n";
    let source = scratch("layouts").join("layouts.c");
    fs::write(&source, program).expect("writable");

    let rust = rust_layouts().into_iter().flat_map(|(name, (size, fields))| {
        let fields = fields.into_iter().map(move |(field, offset)| format!("{name}.{field} {offset}"));
        std::iter::once(format!("{name} {size}")).chain(fields)
    });
    let mut rust: Vec<String> = rust.collect();
    rust.sort();
    for standard in ["c99", "c++11"] {
        let c = build_and_run("layouts", standard, &[&source]);
        let mut c: Vec<&str> = c.lines().collect();
        c.sort_unstable();
        assert_eq!(c, rust, "{standard}");
    }
}

/// Compares with a list that only grows. What a host was compiled with must keep its meaning for ever.
fn compare_with_frozen(file: &str, actual: &[String]) {
    let path = root().join("tests/abi").join(file);
    let frozen = fs::read_to_string(&path).unwrap_or_default();
    let frozen: Vec<&str> = frozen.lines().collect();
    let lost: Vec<_> = frozen.iter().filter(|line| !actual.iter().any(|one| one == *line)).collect();
    let new: Vec<_> = actual.iter().filter(|line| !frozen.contains(&line.as_str())).collect();
    assert!(lost.is_empty(), "removed or changed, which breaks hosts (tests/abi/{file}): {lost:#?}");
    assert!(new.is_empty(), "new: add these lines to tests/abi/{file}, sorted: {new:#?}");
}

#[test]
fn constants_keep_their_values() {
    let mut constants: Vec<String> = Vec::new();
    for line in header().lines() {
        let Some((name, value)) = line.strip_prefix("#define ").and_then(|rest| rest.split_once(' ')) else { continue };
        if let (false, Some(value)) = (name.contains("VERSION"), value.strip_suffix('u')) {
            constants.push(format!("{name} {value}"));
        }
    }
    constants.sort();
    compare_with_frozen("constants.txt", &constants);
}

#[test]
fn functions_are_never_taken_away() {
    let header = header();
    let declared = header.lines().filter(|line| !line.starts_with([' ', '#', '/', '}']) && !line.starts_with("static"));
    let name = |line: &str| {
        let (before, _) = line.split_once('(')?;
        let name = before.rsplit([' ', '*']).next()?;
        (name.starts_with("isocoat_") && !line.contains("typedef") && !line.contains("inline")).then(|| name.to_owned())
    };
    let mut functions: Vec<String> = declared.filter_map(name).collect();
    functions.sort();
    compare_with_frozen("symbols.txt", &functions);
}
