use glam::Vec3;

/// Marks a texel of [`GBuffer::triangle`] that shows the background.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// What a [`View`](crate::View) sees at each texel centre, one array per attribute, row-major, top row first.
///
/// Where nothing is seen, `triangle` is [`NO_TRIANGLE`] and every other attribute is 0.
#[derive(Debug, Clone, PartialEq)]
pub struct GBuffer {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Index into [`Mesh::triangles`](crate::Mesh::triangles), or [`NO_TRIANGLE`].
    pub triangle: Vec<u32>,
    /// View depth, metres.
    pub depth: Vec<f32>,
    /// World position, metres.
    pub position: Vec<Vec3>,
    /// Unit shading normal, turned to the side that is seen.
    pub normal: Vec<Vec3>,
    /// Lambertian albedo, `[0, 1]`.
    pub albedo: Vec<Vec3>,
}

impl GBuffer {
    /// A G-buffer that sees nothing.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        let n = size[0] as usize * size[1] as usize;
        Self {
            size,
            triangle: vec![NO_TRIANGLE; n],
            depth: vec![0.0; n],
            position: vec![Vec3::ZERO; n],
            normal: vec![Vec3::ZERO; n],
            albedo: vec![Vec3::ZERO; n],
        }
    }

    /// Whether texel `i` sees a surface.
    #[must_use]
    #[inline]
    pub fn is_surface(&self, i: usize) -> bool {
        self.triangle[i] != NO_TRIANGLE
    }

    /// Number of texels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.triangle.len()
    }

    /// Bytes that it holds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        // Triangle and depth, position, normal, albedo.
        self.len() * (4 + 4 + 3 * size_of::<Vec3>())
    }

    /// Whether there are no texels.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangle.is_empty()
    }
}
