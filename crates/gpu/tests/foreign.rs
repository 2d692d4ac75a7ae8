//! What a renderer of somebody else gives and takes: its G-buffer in, moved vertices in, images out.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use glam::camera::rh::proj::directx;
use glam::{Affine3A, Mat4, Quat, Vec2, Vec3};
use half::f16;
use indirect_core::{Mesh, NO_TRIANGLE, View, octahedral};
use indirect_gpu::shaders::{IMPORT, POSE};
use indirect_gpu::wgpu::{self, Extent3d, TextureFormat, TextureUsages, TextureView};
use indirect_gpu::{
    Context, DepthEncoding, GBufferFormat, GBufferImport, GBufferTarget, GBufferTextures, GpuError,
    ImageExport, ImportUniform, MovingObjects, NormalEncoding, PassTimer, Pipelines, PoseUniform,
    SceneBuffers, Vec3Pad, read_buffer, storage_buffer,
};
use testkit::layout::{check, check_workgroup_size};
use testkit::scenes::{corner, lights};

const SIZE: [u32; 2] = [13, 7];

#[test]
fn structs_lie_as_in_wgsl() {
    check::<ImportUniform>(&IMPORT).unwrap();
    check::<PoseUniform>(&POSE).unwrap();
    for (module, entry) in [(&IMPORT, "import_texels"), (&POSE, "pose_vertices")] {
        check_workgroup_size(module, entry, [64, 1, 1]).unwrap();
    }
}

/// A texture of `SIZE` whose texels are `bytes`, a whole number of them each.
fn texture(c: &Context, format: TextureFormat, usage: TextureUsages, bytes: &[u8]) -> TextureView {
    let size = Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 };
    let t = c.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    if !bytes.is_empty() {
        let bytes_per_row = Some(bytes.len() as u32 / SIZE[1]);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        c.queue.write_texture(t.as_image_copy(), bytes, layout, size);
    }
    t.create_view(&wgpu::TextureViewDescriptor::default())
}

fn floats(c: &Context, format: TextureFormat, texels: &[f32]) -> TextureView {
    texture(c, format, TextureUsages::TEXTURE_BINDING, bytemuck::cast_slice(texels))
}

fn eye() -> Mat4 {
    let direction = Vec3::new(-0.3, -0.2, -1.0).normalize();
    glam::camera::rh::view::look_to_mat4(Vec3::new(7.0, 2.0, 4.0), direction, Vec3::Y)
}

/// A point and normal for each texel but the first, which sees nothing.
fn texels(view: &View, offset: Vec2) -> Vec<Option<(Vec3, f32, Vec3)>> {
    let point = |i: u32| {
        let at = Vec2::new((i % SIZE[0]) as f32, (i / SIZE[0]) as f32) + 0.5;
        let shift = Vec2::new(offset.x * SIZE[0] as f32, -offset.y * SIZE[1] as f32) * 0.5;
        let depth = 1.0 + 0.1 * i as f32;
        let p = view.ray(at - shift, SIZE).at(depth - view.near);
        let n = Vec3::new((i as f32).sin(), (0.7 * i as f32).cos(), (0.3 * i as f32).sin() + 0.1).normalize();
        (p, depth, n)
    };
    (0..SIZE[0] * SIZE[1]).map(|i| (i > 0).then(|| point(i))).collect()
}

/// Renderers' matrices and formats: every kind of depth and normal, world and view space, jitter, orthographic.
fn cases() -> Vec<(Mat4, GBufferFormat)> {
    use NormalEncoding::{Octahedral, OctahedralUnorm, Signed, Unorm};
    let jitter = Mat4::from_translation(Vec3::new(0.02, -0.03, 0.0));
    let reversed = directx::perspective_infinite_reverse(1.1, 1.6, 0.05) * eye();
    let standard = directx::perspective(1.1, 1.6, 0.5, 40.0) * eye();
    let parallel = directx::orthographic(-3.0, 3.0, -2.0, 2.0, 0.0, 30.0) * eye();
    let format = |depth, normal, view_space| GBufferFormat { depth, normal, view_space, srgb: view_space };
    vec![
        (reversed, format(DepthEncoding::Ndc, Signed, false)),
        (jitter * reversed, format(DepthEncoding::Ndc, Unorm, true)),
        (standard, format(DepthEncoding::Ndc, Octahedral, false)),
        (parallel, format(DepthEncoding::Ndc, OctahedralUnorm, true)),
        (jitter * standard, format(DepthEncoding::View, Signed, true)),
    ]
}

#[test]
fn a_foreign_g_buffer_is_what_its_renderer_drew() {
    let Some(c) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&c.device);
    for (clip_from_world, format) in cases() {
        let clip = View::from_clip(&clip_from_world).unwrap();
        let points = texels(&clip.view, clip.offset);
        let (mut depth, mut normal, mut albedo) = (Vec::new(), Vec::new(), Vec::new());
        for (i, point) in points.iter().enumerate() {
            let nothing = if format.depth == DepthEncoding::Ndc && !clip.reversed { 1.0 } else { 0.0 };
            depth.push(point.map_or(nothing, |(p, depth, _)| {
                let h = clip_from_world * p.extend(1.0);
                if format.depth == DepthEncoding::Ndc { h.z / h.w } else { depth }
            }));
            let n = point.map_or(Vec3::ZERO, |p| p.2);
            let v = &clip.view;
            let n =
                if format.view_space { Vec3::new(n.dot(v.right), n.dot(v.up), -n.dot(v.forward)) } else { n };
            let e = octahedral::encode(n).extend(0.0);
            let texel = match format.normal {
                NormalEncoding::Signed => n * 3.0,
                NormalEncoding::Unorm => n * 0.5 + 0.5,
                NormalEncoding::Octahedral => e,
                _ => e * 0.5 + 0.5,
            };
            normal.extend([texel.x, texel.y, texel.z, 1.0]);
            // The second texel is brighter than light allows.
            albedo.extend([if i == 1 { 1.5 } else { 0.25 }, 0.5, 0.03, 1.0]);
        }
        let target = GBufferTarget::imported(&c.device, SIZE).unwrap();
        let textures = [
            floats(c, TextureFormat::R32Float, &depth),
            floats(c, TextureFormat::Rgba32Float, &normal),
            floats(c, TextureFormat::Rgba32Float, &albedo),
        ];
        let textures = GBufferTextures { depth: &textures[0], normal: &textures[1], albedo: &textures[2] };
        let import = GBufferImport::new(&pipelines, &target, &textures, format).unwrap();
        assert_eq!(import.prepare(&c.queue, &clip_from_world), Ok(clip.view));
        let mut encoder = c.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        import.encode(&mut encoder, &mut PassTimer::off());
        c.queue.submit([encoder.finish()]);
        let found = target.read(&c.device, &c.queue).unwrap();
        for (i, point) in points.iter().enumerate() {
            let vector = |v: &[f32]| Vec3::from_slice(&v[4 * i..]);
            let at = [i as u32 % SIZE[0], i as u32 / SIZE[0]];
            let twin = format.texel(&clip, SIZE, at, (depth[i], vector(&normal), vector(&albedo)));
            let Some((p, d, n)) = point else {
                assert!(twin.is_none() && found.triangle[i] == NO_TRIANGLE);
                assert!(
                    found.position[i] == Vec3::ZERO && found.normal[i] == Vec3::ZERO && found.depth[i] == 0.0
                );
                continue;
            };
            let twin = twin.unwrap();
            assert!(found.triangle[i] != NO_TRIANGLE);
            // NDC depth is known to 2⁻²⁴ of 1, hence view depth to 2⁻²⁴ · depth² / near ≤ 2e-6 · depth², times few roundings.
            let slack = 2e-5 * d * d;
            assert!((twin.depth - d).abs() < slack, "{format:?} {i}: {} for {d}", twin.depth);
            assert!((twin.position - *p).length() < slack, "{format:?} {i}: {} for {p}", twin.position);
            assert!((twin.normal - *n).length() < 1e-5, "{format:?} {i}: {} for {n}", twin.normal);
            // Twins, and one sRGB exponentiation, which shaders may round to 16 ulp.
            assert!((found.position[i] - twin.position).length() < 1e-5 * (1.0 + d), "{format:?} {i}");
            assert!((found.depth[i] - twin.depth).abs() < 1e-5 * d, "{format:?} {i}");
            assert!((found.normal[i] - twin.normal).length() < 1e-5, "{format:?} {i}");
            assert!((found.albedo[i] - twin.albedo).abs().max_element() < 1e-5, "{format:?} {i}");
            let linear = Vec3::new(if i == 1 { 1.0 } else { 0.25 }, 0.5, 0.03);
            // sRGB 0.25, 0.5 and 0.03 are 0.0508761, 0.2140411 and 0.0023220 (IEC 61966-2-1).
            let decoded = Vec3::new(if i == 1 { 1.0 } else { 0.050_876_1 }, 0.214_041_1, 0.002_322);
            let albedo = if format.srgb { decoded } else { linear };
            assert!((twin.albedo - albedo).abs().max_element() < 1e-5, "{format:?} {i}: {}", twin.albedo);
        }
    }
}

#[test]
fn what_cannot_be_imported_or_exported_is_refused_by_name() {
    let Some(c) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&c.device);
    let target = GBufferTarget::imported(&c.device, SIZE).unwrap();
    let view = |format, usage| texture(c, format, usage, &[]);
    let good = view(TextureFormat::Rgba16Float, TextureUsages::TEXTURE_BINDING);
    let of = |depth, normal| GBufferTextures { depth, normal, albedo: &good };
    let make = |target: &GBufferTarget, t: GBufferTextures<'_>| {
        GBufferImport::new(&pipelines, target, &t, GBufferFormat::default()).map(|_| ())
    };
    assert_eq!(make(&target, of(&good, &good)), Ok(()));
    let depth = view(TextureFormat::Depth32Float, TextureUsages::TEXTURE_BINDING);
    assert_eq!(make(&target, of(&depth, &good)), Ok(()));
    let integers = view(TextureFormat::Rgba8Uint, TextureUsages::TEXTURE_BINDING);
    let text = make(&target, of(&good, &integers)).unwrap_err().to_string();
    assert!(text.contains("import_normal") && text.contains("Rgba8Uint"), "{text}");
    let unbound = view(TextureFormat::R32Float, TextureUsages::RENDER_ATTACHMENT);
    let text = make(&target, of(&unbound, &good)).unwrap_err().to_string();
    assert!(text.contains("import_depth") && text.contains("TEXTURE_BINDING"), "{text}");
    let other = GBufferTarget::imported(&c.device, [8, 8]).unwrap();
    let text = make(&other, of(&good, &good)).unwrap_err().to_string();
    assert!(text.contains("8×8") && text.contains("13×7"), "{text}");
    let import =
        GBufferImport::new(&pipelines, &target, &of(&good, &good), GBufferFormat::default()).unwrap();
    assert!(matches!(import.prepare(&c.queue, &Mat4::ZERO), Err(GpuError::ClipMatrix(_))));

    let image = storage_buffer::<Vec3Pad>(&c.device, "image", &[Vec3Pad::default(); 91]).unwrap();
    let export = |texture: &TextureView| ImageExport::new(&pipelines, &image, texture).map(|_| ());
    let text = export(&good).unwrap_err().to_string();
    assert!(text.contains("STORAGE_BINDING"), "{text}");
    let short = storage_buffer::<Vec3Pad>(&c.device, "image", &[Vec3Pad::default(); 90]).unwrap();
    let written = view(TextureFormat::Rgba16Float, TextureUsages::STORAGE_BINDING);
    assert_eq!(export(&written), Ok(()));
    assert!(matches!(ImageExport::new(&pipelines, &short, &written), Err(GpuError::Size { .. })));

    let small = storage_buffer::<[f32; 4]>(&c.device, "small", &[[0.0; 4]; 90]).unwrap();
    let [a, b, d] = [&target.position, &target.normal, &target.albedo].map(Clone::clone);
    let adopted = GBufferTarget::from_buffers(SIZE, [a.clone(), b.clone(), d, target.triangle.clone()]);
    assert!(adopted.is_ok());
    let refused = GBufferTarget::from_buffers(SIZE, [a, b, small, target.triangle]);
    assert!(refused.unwrap_err().to_string().contains("gbuffer_albedo"));
}

#[test]
fn exported_images_are_rounded_to_halves_and_stay_finite() {
    let Some(c) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&c.device);
    let texel = |i: u32| Vec3::new(i as f32 * 0.37, 1.0 / (1.0 + i as f32), if i == 5 { 1e9 } else { 2.0 });
    let pixels: Vec<_> = (0..SIZE[0] * SIZE[1]).map(|i| Vec3Pad::new(texel(i), 0.0)).collect();
    let image = storage_buffer(&c.device, "image", &pixels).unwrap();
    let usage = TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
    let exported = texture(c, TextureFormat::Rgba16Float, usage, &[]);
    let export = ImageExport::new(&pipelines, &image, &exported).unwrap();
    // Rows of a copy begin at multiples of 256 bytes: 32 texels.
    let copy = storage_buffer::<[u16; 4]>(&c.device, "copy", &[[0; 4]; 32 * SIZE[1] as usize]).unwrap();
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(256), rows_per_image: None };
    let mut encoder = c.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    export.encode(&mut encoder, &mut PassTimer::off());
    encoder.copy_texture_to_buffer(
        exported.texture().as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &copy, layout },
        exported.texture().size(),
    );
    c.queue.submit([encoder.finish()]);
    let found: Vec<[f16; 4]> =
        c.read::<[u16; 4]>(&copy).unwrap().iter().map(|t| t.map(f16::from_bits)).collect();
    for i in 0..SIZE[0] * SIZE[1] {
        let [r, g, b, a] = found[(i / SIZE[0] * 32 + i % SIZE[0]) as usize].map(f16::to_f32);
        let wanted = texel(i).min(Vec3::splat(65504.0));
        // Half floats: 2⁻¹¹ relative, rounded either way.
        assert!(
            (Vec3::new(r, g, b) - wanted).abs().cmple(wanted * 9.8e-4).all(),
            "{i}: {r} {g} {b} for {wanted}"
        );
        assert_eq!(a, 1.0);
    }
}

/// What the GPU has of a mesh: positions and normals.
fn read_vertices(c: &Context, scene: &SceneBuffers) -> (Vec<Vec3>, Vec<Vec3>, Vec<Vec2>) {
    let all: Vec<Vec3Pad> = read_buffer(&c.device, &c.queue, scene.vertex_buffer()).unwrap();
    let rows = all.chunks(scene.vertex_stride() as usize);
    rows.map(|r| (r[0].vec3(), r[1].vec3(), Vec2::new(r[0].w, r[1].w))).fold(
        (Vec::new(), Vec::new(), Vec::new()),
        |(mut p, mut n, mut t), (a, b, uv)| {
            p.push(a);
            n.push(b);
            t.push(uv);
            (p, n, t)
        },
    )
}

#[test]
fn objects_move_as_their_twin_does_and_nothing_else_moves() {
    let Some(c) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&c.device);
    for colored in [false, true] {
        let mut scene = corner(lights()[0], 1.0);
        scene.mesh.uvs = (0..scene.mesh.positions.len()).map(|i| Vec2::new(i as f32, -(i as f32))).collect();
        if colored {
            scene.mesh.colors = vec![Vec3::ONE; scene.mesh.positions.len()];
        }
        let buffers = SceneBuffers::upload(&c.device, &scene).unwrap();
        let objects = MovingObjects::new(&pipelines, &buffers, &scene.mesh, &[8..12, 0..4]).unwrap();
        // Turned, stretched and mirrored; the second stays at rest.
        let matrix = Affine3A::from_scale_rotation_translation(
            Vec3::new(1.5, -0.5, 2.0),
            Quat::from_rotation_y(0.8) * Quat::from_rotation_x(0.3),
            Vec3::new(0.1, 0.2, 0.3),
        );
        objects.prepare(&c.queue, 0, &matrix).unwrap();
        objects.prepare(&c.queue, 1, &Affine3A::IDENTITY).unwrap();
        let mut encoder = c.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        objects.encode(&mut encoder, &mut PassTimer::off());
        c.queue.submit([encoder.finish()]);
        let mut posed = scene.mesh.clone();
        posed.pose(&scene.mesh, 8..12, &matrix);
        let (positions, normals, uvs) = read_vertices(c, &buffers);
        assert_eq!(uvs, scene.mesh.uvs, "texture coordinates stay");
        for i in 0..positions.len() {
            // A sum of four products of numbers below 5: 2⁻²³ · 20.
            assert!((positions[i] - posed.positions[i]).length() < 3e-6, "{i}");
            assert!((normals[i] - posed.normals[i]).length() < 3e-6, "{i}");
            assert_eq!(positions[i] == scene.mesh.positions[i], !(8..12).contains(&i), "{i}");
        }
        // Normals are across the moved plane, on the side that they were on.
        let geometric = posed.geometric_normal(4);
        assert!((geometric.dot(posed.normals[8]).abs() - 1.0).abs() < 1e-5);

        // Vertices that move among themselves, and back.
        let mut bent = scene.mesh.clone();
        bent.positions[9].y += 0.25;
        buffers.update(&c.queue, &bent, 8..12).unwrap();
        let (positions, _, _) = read_vertices(c, &buffers);
        assert_eq!(positions[8..12], bent.positions[8..12]);
    }
}

#[test]
fn moves_that_make_no_sense_are_refused() {
    let Some(c) = testkit::gpu() else { return };
    let pipelines = Pipelines::new(&c.device);
    let scene = corner(lights()[0], 1.0);
    let buffers = SceneBuffers::upload(&c.device, &scene).unwrap();
    let new = |r| MovingObjects::new(&pipelines, &buffers, &scene.mesh, &[r]);
    assert!(matches!(new(8..13), Err(GpuError::Vertices { count: 12, .. })));
    let objects = new(8..12).unwrap();
    let identity = Affine3A::IDENTITY;
    assert_eq!(objects.prepare(&c.queue, 1, &identity), Err(GpuError::NoObject { object: 1, count: 1 }));
    assert!(buffers.update(&c.queue, &scene.mesh, 8..13).is_err());
    assert!(buffers.update(&c.queue, &Mesh::default(), 0..1).is_err());
}
