//! The glTF 2.0 schema as far as it is read, for serde. Numbers arrive as f64
//! and are checked where they are used; indices are `u32`, so that negative and
//! fractional ones are refused by the parser with line and column.
//!
//! The `gltf` crate's types are not used: its validation cannot be made to name
//! the offending property of every extension read here, and it knows neither
//! instancing nor our own extensions.

mod list;

use serde::Deserialize;

use self::list::{List, MAX_LARGE};

/// Declares structs whose fields are all optional in JSON: absent fields take their default.
macro_rules! schema {
    ($($(#[$meta:meta])* $name:ident { $($(#[$field_meta:meta])* $field:ident: $ty:ty,)* })*) => {$(
        $(#[$meta])*
        #[derive(Debug, Default, Deserialize)]
        #[serde(rename_all = "camelCase", default)]
        pub(super) struct $name { $($(#[$field_meta])* pub $field: $ty,)* }
    )*};
}

schema! {
    /// The whole file.
    Root {
        asset: Option<Asset>,
        extensions_used: List<String>,
        extensions_required: List<String>,
        accessors: List<Accessor>,
        animations: List<Ignored>,
        buffers: List<Buffer>,
        buffer_views: List<BufferView>,
        cameras: List<Camera, MAX_LARGE>,
        images: List<Image, MAX_LARGE>,
        materials: List<Material, MAX_LARGE>,
        meshes: List<Mesh>,
        nodes: List<Node>,
        samplers: List<Sampler, MAX_LARGE>,
        scene: Option<u32>,
        scenes: List<Scene, MAX_LARGE>,
        textures: List<Texture, MAX_LARGE>,
        extensions: RootExtensions,
    }
    Ignored {}
    Asset {
        version: Option<String>,
        min_version: Option<String>,
    }
    RootExtensions {
        #[serde(rename = "KHR_lights_punctual")]
        lights: Option<Lights>,
    }
    Lights {
        lights: List<Light, MAX_LARGE>,
    }
    Light {
        name: Option<String>,
        #[serde(rename = "type")]
        kind: Option<String>,
        color: Option<[f64; 3]>,
        intensity: Option<f64>,
        spot: Option<Spot>,
    }
    Spot {
        inner_cone_angle: Option<f64>,
        outer_cone_angle: Option<f64>,
    }
    Buffer {
        uri: Option<String>,
        byte_length: Option<u64>,
    }
    BufferView {
        buffer: Option<u32>,
        byte_offset: u64,
        byte_length: Option<u64>,
        byte_stride: Option<u64>,
    }
    Accessor {
        buffer_view: Option<u32>,
        byte_offset: u64,
        component_type: Option<u32>,
        normalized: bool,
        count: Option<u64>,
        #[serde(rename = "type")]
        shape: Option<Shape>,
        sparse: Option<Box<Sparse>>,
    }
    Sparse {
        count: Option<u64>,
        indices: SparsePart,
        values: SparsePart,
    }
    SparsePart {
        buffer_view: Option<u32>,
        byte_offset: u64,
        component_type: Option<u32>,
    }
    Camera {
        name: Option<String>,
        #[serde(rename = "type")]
        kind: Option<String>,
        perspective: Option<Perspective>,
        orthographic: Option<Orthographic>,
    }
    Perspective {
        yfov: Option<f64>,
        aspect_ratio: Option<f64>,
        znear: Option<f64>,
        zfar: Option<f64>,
    }
    Orthographic {
        xmag: Option<f64>,
        ymag: Option<f64>,
        znear: Option<f64>,
        zfar: Option<f64>,
    }
    Image {
        name: Option<String>,
        uri: Option<String>,
        mime_type: Option<String>,
        buffer_view: Option<u32>,
    }
    Sampler {
        mag_filter: Option<u32>,
        min_filter: Option<u32>,
        wrap_s: Option<u32>,
        wrap_t: Option<u32>,
    }
    Texture {
        sampler: Option<u32>,
        source: Option<u32>,
    }
    Mesh {
        name: Option<String>,
        primitives: List<Primitive>,
    }
    /// The attributes that are read; others are ignored, as the specification allows.
    Attributes {
        #[serde(rename = "POSITION")]
        position: Option<u32>,
        #[serde(rename = "NORMAL")]
        normal: Option<u32>,
        #[serde(rename = "TANGENT")]
        tangent: Option<u32>,
        #[serde(rename = "TEXCOORD_0")]
        texcoord_0: Option<u32>,
        #[serde(rename = "TEXCOORD_1")]
        texcoord_1: Option<u32>,
        #[serde(rename = "COLOR_0")]
        color_0: Option<u32>,
    }
    Node {
        name: Option<String>,
        children: Vec<u32>,
        mesh: Option<u32>,
        camera: Option<u32>,
        skin: Option<u32>,
        matrix: Option<Box<[f64; 16]>>,
        translation: Option<[f64; 3]>,
        rotation: Option<[f64; 4]>,
        scale: Option<[f64; 3]>,
        extensions: Option<Box<NodeExtensions>>,
    }
    NodeExtensions {
        #[serde(rename = "KHR_lights_punctual")]
        light: Option<NodeLight>,
        #[serde(rename = "EXT_mesh_gpu_instancing")]
        instancing: Option<Instancing>,
    }
    NodeLight {
        light: Option<u32>,
    }
    Instancing {
        attributes: InstancingAttributes,
    }
    InstancingAttributes {
        #[serde(rename = "TRANSLATION")]
        translation: Option<u32>,
        #[serde(rename = "ROTATION")]
        rotation: Option<u32>,
        #[serde(rename = "SCALE")]
        scale: Option<u32>,
    }
    Scene {
        nodes: Vec<u32>,
        extensions: SceneExtensions,
    }
    SceneExtensions {
        #[serde(rename = "ETENDUE_environment")]
        environment: Option<Environment>,
        #[serde(rename = "ETENDUE_medium")]
        medium: Option<Box<Medium>>,
    }
    Environment {
        radiance: Option<[f64; 3]>,
        uri: Option<String>,
        intensity: Option<f64>,
        rotation: Option<f64>,
    }
    /// Of a material or a scene.
    Medium {
        absorption: Option<[f64; 3]>,
        scattering: Option<[f64; 3]>,
        phase: Option<String>,
        g: Option<f64>,
        rayleigh550: Option<f64>,
        priority: Option<i32>,
    }
    Material {
        name: Option<String>,
        pbr_metallic_roughness: MetallicRoughness,
        normal_texture: Option<TextureInfo>,
        emissive_texture: Option<TextureInfo>,
        emissive_factor: Option<[f64; 3]>,
        alpha_mode: Option<String>,
        alpha_cutoff: Option<f64>,
        double_sided: bool,
        extensions: MaterialExtensions,
    }
    MetallicRoughness {
        base_color_factor: Option<[f64; 4]>,
        base_color_texture: Option<TextureInfo>,
        metallic_factor: Option<f64>,
        roughness_factor: Option<f64>,
        metallic_roughness_texture: Option<TextureInfo>,
    }
    TextureInfo {
        index: Option<u32>,
        tex_coord: u32,
        /// Normal textures only.
        scale: Option<f64>,
        extensions: TextureExtensions,
    }
    TextureExtensions {
        #[serde(rename = "KHR_texture_transform")]
        transform: Option<TextureTransform>,
    }
    TextureTransform {
        offset: Option<[f64; 2]>,
        rotation: Option<f64>,
        scale: Option<[f64; 2]>,
        tex_coord: Option<u32>,
    }
    MaterialExtensions {
        #[serde(rename = "KHR_materials_emissive_strength")]
        emissive_strength: Option<EmissiveStrength>,
        #[serde(rename = "KHR_materials_ior")]
        ior: Option<Ior>,
        #[serde(rename = "KHR_materials_specular")]
        specular: Option<Specular>,
        #[serde(rename = "KHR_materials_transmission")]
        transmission: Option<Box<Transmission>>,
        #[serde(rename = "KHR_materials_volume")]
        volume: Option<Box<Volume>>,
        #[serde(rename = "ETENDUE_medium")]
        medium: Option<Box<Medium>>,
        #[serde(rename = "KHR_materials_unlit")]
        unlit: Option<Ignored>,
    }
    EmissiveStrength {
        emissive_strength: Option<f64>,
    }
    Ior {
        ior: Option<f64>,
    }
    Specular {
        specular_factor: Option<f64>,
        specular_texture: Option<TextureInfo>,
        specular_color_factor: Option<[f64; 3]>,
        specular_color_texture: Option<TextureInfo>,
    }
    Transmission {
        transmission_factor: Option<f64>,
        transmission_texture: Option<TextureInfo>,
    }
    Volume {
        thickness_factor: Option<f64>,
        attenuation_color: Option<[f64; 3]>,
        attenuation_distance: Option<f64>,
    }
}

/// One primitive. `attributes` must be there: it keeps `{},{},…` from turning
/// three bytes of JSON into a hundred of memory.
#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<u32>,
    pub material: Option<u32>,
    pub mode: Option<u32>,
    #[serde(default)]
    pub targets: List<Ignored>,
}

/// Shape of an accessor's elements.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}
