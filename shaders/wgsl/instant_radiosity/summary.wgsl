// summary: the area that bounds virtual lights, and what stands for later bounces; one workgroup.
// Twin: crates/instant-radiosity/src/cpu/summary.rs.

@group(0) @binding(0) var<uniform> settings: FrameSettings;
@group(0) @binding(1) var<storage, read> vpls: array<Vpl>;
@group(0) @binding(2) var<storage, read_write> summary: Summary;

const THREADS: u32 = 256u;
/// Largest share of a bounce's flux that the bounce after it is taken to keep.
const MOST_KEPT: f32 = 0.95;

/// Luminance of the flux times area, and luminance.
var<workgroup> areas: array<vec2<f32>, 256>;
/// Flux of the last bounce but one, and of the last.
var<workgroup> earlier: array<vec3<f32>, 256>;
var<workgroup> last: array<vec3<f32>, 256>;

@compute @workgroup_size(256)
fn summarise(@builtin(local_invocation_index) thread: u32) {
    let n = settings.per_bounce;
    let count = n * settings.bounces;
    var area = vec2(0.0);
    var flux_earlier = vec3(0.0);
    var flux_last = vec3(0.0);
    for (var i = thread; i < count; i += THREADS) {
        let v = vpls[i];
        let l = luminance(v.flux);
        area += vec2(v.area * l, l);
        let bounce = i / n;
        if bounce + 1u == settings.bounces {
            flux_last += v.flux;
        } else if bounce + 2u == settings.bounces {
            flux_earlier += v.flux;
        }
    }
    areas[thread] = area;
    earlier[thread] = flux_earlier;
    last[thread] = flux_last;
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if thread < half {
            areas[thread] += areas[thread + half];
            earlier[thread] += earlier[thread + half];
            last[thread] += last[thread + half];
        }
    }
    if thread == 0u {
        var kept = vec3(0.0);
        if settings.tail == 1u {
            for (var k = 0u; k < 3u; k++) {
                if earlier[0][k] > 0.0 {
                    kept[k] = min(last[0][k] / earlier[0][k], MOST_KEPT);
                }
            }
        }
        var mean = 0.0;
        if areas[0].y > 0.0 {
            mean = settings.bound * areas[0].x / areas[0].y;
        }
        summary = Summary(1.0 / (1.0 - kept), mean);
    }
}
