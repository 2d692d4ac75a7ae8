// What `gather_final` binds where its rays go through the grids.

@group(0) @binding(5) var<storage, read> voxels: array<Voxel>;
@group(0) @binding(6) var<storage, read> voxel_normals: array<u32>;
