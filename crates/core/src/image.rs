use glam::Vec3;

/// A linear, scene-referred RGB image in f32, row-major, top row first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Image {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// `size[0] · size[1]` pixels.
    pub pixels: Vec<Vec3>,
}

impl Image {
    /// A black image.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        Self::filled(size, Vec3::ZERO)
    }

    /// An image of one colour.
    #[must_use]
    pub fn filled(size: [u32; 2], value: Vec3) -> Self {
        Self { size, pixels: vec![value; size[0] as usize * size[1] as usize] }
    }

    /// The pixel in column `x`, row `y`. Panics outside the image.
    #[must_use]
    #[inline]
    pub fn get(&self, x: u32, y: u32) -> Vec3 {
        assert!(x < self.size[0] && y < self.size[1], "pixel ({x}, {y}) outside {:?}", self.size);
        self.pixels[y as usize * self.size[0] as usize + x as usize]
    }

    /// Mean of all pixels, summed in f64; zero for an empty image.
    #[must_use]
    pub fn mean(&self) -> Vec3 {
        let sum = self.pixels.iter().fold(glam::DVec3::ZERO, |sum, p| sum + p.as_dvec3());
        if self.pixels.is_empty() { Vec3::ZERO } else { (sum / self.pixels.len() as f64).as_vec3() }
    }

    /// Number of channel values that are NaN or infinite.
    #[must_use]
    pub fn non_finite(&self) -> usize {
        self.pixels.iter().flat_map(|p| p.to_array()).filter(|v| !v.is_finite()).count()
    }

    /// Pixel-wise sum. Panics when the sizes differ.
    #[must_use]
    pub fn sum(&self, other: &Self) -> Self {
        assert_eq!(self.size, other.size, "images of different sizes cannot be added");
        let pixels = self.pixels.iter().zip(&other.pixels).map(|(a, b)| *a + *b).collect();
        Self { size: self.size, pixels }
    }
}
