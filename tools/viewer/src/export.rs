//! Meshes of one frame as PLY and OBJ: formats of a few lines, which no crate would make shorter.

use std::fs::File;
use std::io::{BufWriter, Result, Write};
use std::path::Path;

use isocoat::surface::mesh::Mesh;

/// A mesh with the name of its body.
pub type Named = (String, Mesh);

/// Binary PLY: one mesh of all, with normals and the number of the body at each vertex.
pub fn ply(meshes: &[Named], path: &Path) -> Result<()> {
    let (vertices, triangles) =
        meshes.iter().fold((0, 0), |(v, t), (_, mesh)| (v + mesh.positions.len(), t + mesh.triangles.len()));
    let mut out = BufWriter::new(File::create(path)?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment in metres\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
         property uchar body\nelement face {triangles}\nproperty list uchar uint vertex_indices\nend_header\n"
    )?;
    for (body, (_, mesh)) in meshes.iter().enumerate() {
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            for x in position.iter().chain(normal) {
                out.write_all(&(*x as f32).to_le_bytes())?;
            }
            out.write_all(&[body as u8])?;
        }
    }
    let mut first = 0;
    for (_, mesh) in meshes {
        for triangle in &mesh.triangles {
            out.write_all(&[3])?;
            for corner in triangle {
                out.write_all(&(corner + first).to_le_bytes())?;
            }
        }
        first += mesh.positions.len() as u32;
    }
    out.flush()
}

/// Wavefront OBJ: an object a body.
pub fn obj(meshes: &[Named], path: &Path) -> Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    // Counted from 1.
    let mut first = 1;
    for (name, mesh) in meshes {
        writeln!(out, "o {name}")?;
        for [x, y, z] in &mesh.positions {
            writeln!(out, "v {x} {y} {z}")?;
        }
        for [x, y, z] in &mesh.normals {
            writeln!(out, "vn {x} {y} {z}")?;
        }
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| corner + first);
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
        first += mesh.positions.len() as u32;
    }
    out.flush()
}
