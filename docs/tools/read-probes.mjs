// Reads what `cargo xtask bake SCENE --format three` wrote, by three.js itself, and compares its irradiance with the path tracer's:
//
//     npm install three && node docs/tools/read-probes.mjs bake
//
// Ends with an error where probes miss by more than the percentage given as a second argument.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { SphericalHarmonics3, Vector3 } from 'three';

const folder = process.argv[2] ?? 'bake';
const most = Number(process.argv[3] ?? 100);
const read = (name) => JSON.parse(readFileSync(join(folder, name), 'utf8'));
const grid = read('probes.json');
const check = read('check.json');
const bytes = readFileSync(join(folder, grid.file));
const numbers = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
const [nx, ny, nz] = grid.resolution;
if (numbers.length !== nx * ny * nz * 27) throw new Error(`${grid.file}: ${numbers.length} numbers for ${nx * ny * nz} probes`);

function probe(x, y, z) {
    return new SphericalHarmonics3().fromArray(numbers, ((z * ny + y) * nx + x) * 27);
}

// three.js leaves interpolation to the application: between the eight probes around, clamped at the borders.
function irradiance(position, normal) {
    const sum = new SphericalHarmonics3();
    const at = position.map((p, a) => Math.min(Math.max((p - grid.origin[a]) / grid.spacing[a], 0), grid.resolution[a] - 1));
    for (let corner = 0; corner < 8; corner++) {
        const cell = at.map((t, a) => Math.min(Math.floor(t) + ((corner >> a) & 1), grid.resolution[a] - 1));
        const weight = at.reduce((w, t, a) => w * ((corner >> a) & 1 ? t - Math.floor(t) : 1 - (t - Math.floor(t))), 1);
        sum.addScaledSH(probe(...cell), weight);
    }
    return sum.getIrradianceAt(new Vector3(...normal), new Vector3());
}

let worst = 0;
for (const [name, points] of [['at probes', check.at_probes], ['anywhere between', check.between]]) {
    let [difference, whole] = [0, 0];
    for (const p of points) {
        const truth = new Vector3(...p.irradiance);
        difference += irradiance(p.position, p.normal).sub(truth).lengthSq();
        whole += truth.lengthSq();
    }
    const percent = 100 * Math.sqrt(difference / whole);
    worst = Math.max(worst, percent);
    console.log(`irradiance ${name}: ${percent.toFixed(2)} % rms of the path tracer's at ${points.length} points`);
}
if (!(worst <= most)) {
    console.error(`error: more than ${most} %`);
    process.exit(1);
}
