//! Binary glTF: a scene of meshes. What is rigid moves as a node, a body of many links hangs on its links as a skin, and what
//! flows shows one mesh a frame.

use std::io::Result;
use std::path::Path;

use isocoat::math::{Pose, Vec3};
use isocoat::surface::mesh::Mesh;
use serde_json::{Value, json};

const FLOAT: u32 = 5126;
const UINT: u32 = 5125;
const USHORT: u32 = 5123;
const VERTICES: u32 = 34962;
const CORNERS: u32 = 34963;

/// A glTF file that grows.
pub struct Glb {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    skins: Vec<Value>,
    samplers: Vec<Value>,
    channels: Vec<Value>,
    colours: usize,
}

impl Glb {
    pub fn new() -> Self {
        Self {
            binary: Vec::new(),
            views: Vec::new(),
            accessors: Vec::new(),
            meshes: Vec::new(),
            nodes: Vec::new(),
            skins: Vec::new(),
            samplers: Vec::new(),
            channels: Vec::new(),
            colours: 0,
        }
    }

    fn accessor(&mut self, bytes: &[u8], target: Option<u32>, mut description: Value) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.binary.extend_from_slice(bytes);
        self.views.push(view);
        description["bufferView"] = (self.views.len() - 1).into();
        self.accessors.push(description);
        self.accessors.len() - 1
    }

    fn floats(&mut self, numbers: &[f32], kind: &str, size: usize, target: Option<u32>, bounded: bool) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let mut description = json!({ "componentType": FLOAT, "count": numbers.len() / size, "type": kind });
        if bounded {
            let bound = |pick: fn(f32, f32) -> f32, from: f32| -> Vec<f32> {
                (0..size).map(|axis| numbers.iter().skip(axis).step_by(size).copied().fold(from, pick)).collect()
            };
            description["min"] = bound(f32::min, f32::INFINITY).into();
            description["max"] = bound(f32::max, f32::NEG_INFINITY).into();
        }
        self.accessor(&bytes, target, description)
    }

    /// Adds a mesh in the frame of a pose, in one of the colours; none when it is empty.
    pub fn mesh(&mut self, mesh: &Mesh, frame: &Pose, colour: usize) -> Option<usize> {
        if mesh.triangles.is_empty() {
            return None;
        }
        let local = |points: &[[f64; 3]], to: &dyn Fn(Vec3) -> Vec3| -> Vec<f32> {
            points.iter().flat_map(|p| <[f64; 3]>::from(to(Vec3::from(*p)))).map(|x| x as f32).collect()
        };
        let turn = frame.rotation.inverse();
        let positions = local(&mesh.positions, &|p| frame.inverse_transform_point(&p));
        let normals = local(&mesh.normals, &|n| (turn * n).normalize());
        let positions = self.floats(&positions, "VEC3", 3, Some(VERTICES), true);
        let normals = self.floats(&normals, "VEC3", 3, Some(VERTICES), false);
        let corners: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()).collect();
        let description = json!({ "componentType": UINT, "count": 3 * mesh.triangles.len(), "type": "SCALAR" });
        let corners = self.accessor(&corners, Some(CORNERS), description);
        self.colours = self.colours.max(colour + 1);
        self.meshes.push(json!({ "primitives": [{
            "attributes": { "POSITION": positions, "NORMAL": normals }, "indices": corners, "material": colour,
        }] }));
        Some(self.meshes.len() - 1)
    }

    /// Hangs a mesh on joints: of each vertex up to four, with weights that add up to 1.
    pub fn hang(&mut self, mesh: usize, joints: &[[u16; 4]], weights: &[[f32; 4]]) {
        let bytes: Vec<u8> = joints.as_flattened().iter().flat_map(|joint| joint.to_le_bytes()).collect();
        let description = json!({ "componentType": USHORT, "count": joints.len(), "type": "VEC4" });
        let joints = self.accessor(&bytes, Some(VERTICES), description);
        let weights = self.floats(weights.as_flattened(), "VEC4", 4, Some(VERTICES), false);
        let attributes = &mut self.meshes[mesh]["primitives"][0]["attributes"];
        (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (joints.into(), weights.into());
    }

    /// Adds a node that shows nothing: a joint of a skin.
    pub fn joint(&mut self, name: &str, pose: &Pose) -> usize {
        self.nodes.push(json!({
            "name": name, "translation": numbers(&pose.position), "rotation": quaternion(pose),
        }));
        self.nodes.len() - 1
    }

    /// Adds a node that shows a mesh of the world as its joints carry it; `poses` are theirs when it hangs as it is.
    pub fn skin(&mut self, name: &str, mesh: usize, joints: &[usize], poses: &[Pose]) {
        let matrices: Vec<f32> = poses.iter().flat_map(inverse_matrix).collect();
        let matrices = self.floats(&matrices, "MAT4", 16, None, false);
        self.skins.push(json!({ "joints": joints, "inverseBindMatrices": matrices }));
        self.nodes.push(json!({ "name": name, "mesh": mesh, "skin": self.skins.len() - 1 }));
    }

    /// Adds a node that shows a mesh.
    pub fn node(&mut self, name: &str, mesh: usize, pose: &Pose) -> usize {
        self.nodes.push(json!({
            "name": name, "mesh": mesh, "translation": numbers(&pose.position), "rotation": quaternion(pose),
        }));
        self.nodes.len() - 1
    }

    /// Moves a node: its pose at each of these times [s].
    pub fn follow(&mut self, node: usize, times: &[f64], poses: &[Pose]) {
        let input = self.times(times);
        let places: Vec<f32> = poses.iter().flat_map(|pose| numbers(&pose.position)).collect();
        let turns: Vec<f32> = poses.iter().flat_map(quaternion).collect();
        let places = self.floats(&places, "VEC3", 3, None, false);
        let turns = self.floats(&turns, "VEC4", 4, None, false);
        self.channel(node, "translation", "LINEAR", input, places);
        self.channel(node, "rotation", "LINEAR", input, turns);
    }

    /// Shows a node only from one time on, up to another [s]: at other times it has no size.
    pub fn show_between(&mut self, node: usize, from: f64, to: Option<f64>, first: f64) {
        let mut keys = if from > first { vec![(first, 0.0_f32)] } else { Vec::new() };
        keys.push((from, 1.0));
        keys.extend(to.map(|to| (to, 0.0)));
        let times: Vec<f64> = keys.iter().map(|key| key.0).collect();
        let input = self.times(&times);
        let sizes: Vec<f32> = keys.iter().flat_map(|key| [key.1; 3]).collect();
        let sizes = self.floats(&sizes, "VEC3", 3, None, false);
        self.channel(node, "scale", "STEP", input, sizes);
    }

    fn times(&mut self, times: &[f64]) -> usize {
        let times: Vec<f32> = times.iter().map(|time| *time as f32).collect();
        self.floats(&times, "SCALAR", 1, None, true)
    }

    fn channel(&mut self, node: usize, path: &str, interpolation: &str, input: usize, output: usize) {
        self.samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
        self.channels.push(json!({ "sampler": self.samplers.len() - 1, "target": { "node": node, "path": path } }));
    }

    /// The file. The z axis of the scene, which points up, becomes the y axis.
    pub fn bytes(mut self) -> Vec<u8> {
        let children: Vec<usize> = (0..self.nodes.len()).collect();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let mut root = json!({ "name": "scene", "rotation": [-half, 0.0, 0.0, half] });
        if !children.is_empty() {
            root["children"] = children.into();
        }
        self.nodes.push(root);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let materials: Vec<Value> = (0..self.colours).map(material).collect();
        let mut document = json!({
            "asset": { "version": "2.0", "generator": "isocoat-view" },
            "scene": 0,
            "scenes": [{ "nodes": [self.nodes.len() - 1] }],
            "nodes": self.nodes,
        });
        // Empty lists are no glTF.
        for (name, list) in [
            ("meshes", self.meshes),
            ("materials", materials),
            ("skins", self.skins),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
        ] {
            if !list.is_empty() {
                document[name] = list.into();
            }
        }
        if !self.channels.is_empty() {
            document["animations"] = json!([{ "samplers": self.samplers, "channels": self.channels }]);
        }
        if !self.binary.is_empty() {
            document["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, content) in [(b"JSON", &text), (b"BIN\0", &self.binary)] {
            if !content.is_empty() {
                out.extend_from_slice(&(content.len() as u32).to_le_bytes());
                out.extend_from_slice(kind);
                out.extend_from_slice(content);
            }
        }
        let length = out.len() as u32;
        out[8..12].copy_from_slice(&length.to_le_bytes());
        out
    }

    pub fn write(self, path: &Path) -> Result<()> {
        std::fs::write(path, self.bytes())
    }
}

fn material(colour: usize) -> Value {
    let [r, g, b] =
        [[0.6, 0.15, 0.06], [0.08, 0.27, 0.48], [0.67, 0.4, 0.08], [0.15, 0.34, 0.11], [0.22, 0.25, 0.3]][colour % 5];
    json!({ "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6 } })
}

fn numbers(v: &Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn quaternion(pose: &Pose) -> [f32; 4] {
    let q = pose.rotation.coords;
    [q.x as f32, q.y as f32, q.z as f32, q.w as f32]
}

/// What takes the world to the frame of a pose, column by column.
fn inverse_matrix(pose: &Pose) -> [f32; 16] {
    let turn = pose.rotation.inverse();
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| turn * axis);
    let place = pose.inverse_transform_point(&Vec3::zeros());
    let mut matrix = [0.0; 16];
    for (column, v) in axes.iter().chain([&place]).enumerate() {
        matrix[4 * column..4 * column + 3].copy_from_slice(&numbers(v));
    }
    matrix[15] = 1.0;
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_gltf() {
        let mut glb = Glb::new();
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: vec![[0, 1, 2]],
            valid: Vec::new(),
        };
        let at = glb.mesh(&mesh, &Pose::default(), 0).unwrap();
        let node = glb.node("body", at, &Pose::default());
        glb.follow(node, &[0.0, 1.0], &[Pose::default(), Pose::at(1.0, 2.0, 3.0)]);
        let node = glb.node("one frame", at, &Pose::default());
        glb.show_between(node, 0.5, Some(1.0), 0.0);
        let bytes = glb.bytes();
        let read = gltf::Gltf::from_slice(&bytes).unwrap();
        assert_eq!((read.nodes().count(), read.meshes().count()), (3, 1));
        let animation = read.animations().next().unwrap();
        assert_eq!(animation.channels().count(), 3);
        let blob = read.blob.as_deref().unwrap();
        let primitive = read.meshes().next().unwrap().primitives().next().unwrap();
        let positions: Vec<_> = primitive.reader(|_| Some(blob)).read_positions().unwrap().collect();
        assert_eq!(positions[1], [1.0, 0.0, 0.0]);
        assert!(gltf::Gltf::from_slice(&Glb::new().bytes()).is_ok());
    }
}
