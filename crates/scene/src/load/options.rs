/// How a file is read.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoadOptions {
    /// Textures are averaged down, in linear light, until neither side exceeds this many texels. Higher keeps more detail of
    /// the albedo, lower saves memory; diffuse light transport sees averages. At least 1, default 256.
    pub max_texture_size: u32,
    /// Largest number of triangles, all instances counted; more is an error. Default 2²⁴, about 1.5 GB.
    pub max_triangles: usize,
    /// Also read the second set of texture coordinates, by convention that of light maps, into
    /// [`Loaded::lightmap_uvs`](crate::Loaded::lightmap_uvs). Default: no, scenes are rendered without it.
    pub lightmap_uvs: bool,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { max_texture_size: 256, max_triangles: 1 << 24, lightmap_uvs: false }
    }
}
