import init, { Page, settings_of, shader_count, shader_name, shader_source, techniques } from './live.js';

const $ = (id) => document.getElementById(id);
const canvas = $('canvas');

function fail(error) {
    $('error').textContent = String(error.message ?? error);
    $('error').hidden = false;
}

// What the browser's compiler says of every shader, also of those that no technique here uses.
async function shaderErrors() {
    const device = await (await navigator.gpu.requestAdapter()).requestDevice();
    const errors = [];
    device.onuncapturederror = (event) => event.preventDefault();
    for (let i = 0; i < shader_count(); i++) {
        const info = await device.createShaderModule({ code: shader_source(i) }).getCompilationInfo();
        for (const m of info.messages) if (m.type === 'error') errors.push(`${shader_name(i)} line ${m.lineNum}: ${m.message}`);
    }
    device.destroy();
    return errors;
}

// One picture of each technique, for `cargo xtask test`: written to where the page came from.
async function check(size) {
    const errors = await shaderErrors();
    if (errors.length > 0) throw new Error(errors.join('; '));
    canvas.width = canvas.height = size;
    const results = [];
    let page;
    for (const name of techniques().split(',')) {
        if (page) page.choose(name); else page = await Page.open(canvas, name);
        page.frame();
        const image = await page.read();
        const triangles = await page.triangles();
        results.push({ name, settings: settings_of(name), size, image: Array.from(image), triangles: Array.from(triangles) });
    }
    await fetch('result', { method: 'POST', body: JSON.stringify(results) });
}

async function run() {
    let page = await Page.open(canvas, techniques().split(',')[0]);
    for (const name of techniques().split(',')) $('technique').add(new Option(name));
    const change = (work) => (event) => { try { work(event); } catch (e) { fail(e); } };
    $('technique').onchange = change(() => page.choose($('technique').value));
    const move = change(() => page.light(Number($('x').value), 0, Number($('z').value)));
    $('x').oninput = $('z').oninput = move;
    $('exposure').oninput = change(() => page.exposure(2 ** Number($('exposure').value)));
    let from;
    canvas.onpointerdown = (e) => { from = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); };
    canvas.onpointerup = canvas.onpointercancel = () => { from = undefined; };
    canvas.onpointermove = (e) => {
        if (!from) return;
        page.orbit((e.clientX - from[0]) / 300, (e.clientY - from[1]) / 300, 1);
        from = [e.clientX, e.clientY];
    };
    canvas.onwheel = (e) => { e.preventDefault(); page.orbit(0, 0, e.deltaY > 0 ? 1.05 : 1 / 1.05); };
    const keys = { ArrowLeft: [-.05, 0, 1], ArrowRight: [.05, 0, 1], ArrowUp: [0, -.05, 1], ArrowDown: [0, .05, 1], '+': [0, 0, 1 / 1.05], '-': [0, 0, 1.05] };
    canvas.onkeydown = (e) => { if (keys[e.key]) { e.preventDefault(); page.orbit(...keys[e.key]); } };
    $('controls').disabled = false;
    let mean;
    const draw = async () => {
        const start = performance.now();
        try {
            page.frame();
            await page.done();
        } catch (e) { return fail(e); }
        const time = performance.now() - start;
        mean = mean === undefined ? time : mean + (time - mean) / 8;
        $('time').textContent = `${mean.toFixed(1)} ms a frame`;
        document.body.dataset.frames = Number(document.body.dataset.frames ?? 0) + 1;
        requestAnimationFrame(draw);
    };
    requestAnimationFrame(draw);
}

try {
    if (!navigator.gpu) throw new Error('This browser has no WebGPU. Recent versions of Chrome, Edge, Safari and Firefox have; on Linux it may have to be switched on.');
    await init();
    const size = new URLSearchParams(location.search).get('check');
    if (size) await check(Number(size)); else await run();
} catch (error) {
    fail(error);
    console.error(error);
    if (location.search.includes('check')) await fetch('result', { method: 'POST', body: JSON.stringify({ error: String(error.message ?? error) }) });
}
