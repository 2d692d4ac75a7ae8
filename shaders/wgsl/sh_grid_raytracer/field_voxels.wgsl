// What `field` binds where its rays go through the grids.

@group(0) @binding(7) var<storage, read> voxels: array<Voxel>;
@group(0) @binding(8) var<storage, read> voxel_normals: array<u32>;
