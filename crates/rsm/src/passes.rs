/// Names of the passes that make the maps: what a renderer skips that has them already.
pub const MAP_PASSES: [&str; 3] = ["surface", "flux", "pyramid"];

/// The rows of a technique that begins with reflective shadow maps: `surface`, `flux` and `pyramid`. Its output and its buffers
/// hold the maps in a field `rsm`, its setup the number of their texels in `options.resolution`.
///
/// A second argument says how often `pyramid` runs, for techniques that do not always need it.
#[macro_export]
macro_rules! map_rows {
    ($technique:ty) => {
        $crate::map_rows!($technique, |_| 1)
    };
    ($technique:ty, $pyramids:expr) => {
        $crate::indirect_technique::passes!(
            $technique,
            [
                Row {
                    name: "surface",
                    times: |_| 1,
                    cpu: |f, o, _| o.rsm = $crate::cpu::surface(f.accel, f.setup.options.resolution),
                    gpu: |b, pass, _| {
                        b.buffers.rsm.surface(b.pipelines, pass);
                        Ok(())
                    },
                    data: |b, o, x, _| b.rsm.exchange_surface(&mut o.rsm, x),
                },
                Row {
                    name: "flux",
                    times: |_| 1,
                    cpu: |f, o, _| $crate::cpu::flux_of_maps(&mut o.rsm, f.scene),
                    gpu: |b, pass, _| b.buffers.rsm.flux(b.pipelines, pass),
                    data: |b, o, x, _| b.rsm.exchange_flux(&mut o.rsm, x),
                },
                Row {
                    name: "pyramid",
                    times: $pyramids,
                    cpu: |_, o, _| $crate::cpu::pyramid_of_maps(&mut o.rsm),
                    gpu: |b, pass, _| b.buffers.rsm.pyramid(b.pipelines, pass),
                    data: |b, o, x, _| b.rsm.exchange_pyramid(&mut o.rsm, x),
                },
            ]
        )
    };
}
