//! Prints the milliseconds of a sort, a scan and a compaction.
//!
//! `sort_times [--count N] [--repeats N]`: medians of wall time from submission to the end of the work, on the adapter that
//! `INDIRECT_ADAPTER` chooses; beside each sort the standard library's stable sort of the same pairs, on one thread.
#![allow(clippy::print_stdout, reason = "a command-line tool")]

use std::time::Instant;

use indirect_core::sort::radix_sort_pairs;
use indirect_gpu::wgpu::PollType;
use indirect_gpu::{
    AdapterChoice, Compact, Context, GpuError, Pass, PassTimer, Pipelines, RadixSort, Scan, named,
    storage_buffer,
};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let mut options = std::env::args().skip(1);
    let (mut count, mut repeats) = (300_000, 9);
    while let Some(option) = options.next() {
        let value = options.next().ok_or(format!("{option} needs a value"))?;
        match option.as_str() {
            "--count" => count = value.parse::<u32>()?.max(1),
            "--repeats" => repeats = value.parse::<usize>()?.max(1),
            _ => return Err(format!("unknown option {option}").into()),
        }
    }
    let gpu = Context::new(&AdapterChoice::from_env())?;
    let pipelines = Pipelines::new(&gpu.device);
    println!("{count} elements on {}", gpu.describe());

    // Weyl's sequence, stirred: any keys will do.
    let keys: Vec<u32> =
        (0..count).map(|i| (i.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b).wrapping_mul(0xc2b2_ae35)).collect();
    let device = &gpu.device;
    let payloads: Vec<u32> = (0..count).collect();
    for bits in [8, 13, 16, 20, 24, 32] {
        let buffers = [
            storage_buffer(device, "keys", &keys)?,
            storage_buffer(device, "payloads", &payloads)?,
            storage_buffer(device, "count", &[count])?,
        ];
        let list = [named("keys", &buffers[0]), named("payloads", &buffers[1]), named("count", &buffers[2])];
        let sort = RadixSort::new(device, count, bits)?;
        let mut pass = Pass::new("sort");
        sort.encode(&pipelines, &mut pass, &list)?;
        // The keys must lie as they did before each time.
        let refill = || gpu.queue.write_buffer(&buffers[0], 0, bytemuck::cast_slice(&keys));
        let ms = median(repeats, || time(&gpu, &pass, refill))?;
        let twin = median(repeats, || {
            let (mut keys, mut payloads) = (keys.clone(), payloads.clone());
            let start = Instant::now();
            radix_sort_pairs(&mut keys, &mut payloads, bits);
            Ok(start.elapsed().as_secs_f64() * 1e3)
        })?;
        println!("sort by {bits} bits: {ms:.2} ms, twin {twin:.2} ms");
    }

    let (values, total) =
        (storage_buffer(device, "values", &keys)?, storage_buffer(device, "count", &[0, 0])?);
    let mut pass = Pass::new("scan");
    Scan::new(device, count)?.encode(&pipelines, &mut pass, &[named("values", &values)])?;
    println!("scan: {:.2} ms", median(repeats, || time(&gpu, &pass, || ()))?);
    let mut pass = Pass::new("compact");
    let list = [named("flags", &values), named("count", &total)];
    Compact::new(device, count, count)?.encode(&pipelines, &mut pass, &list)?;
    println!("compact: {:.2} ms", median(repeats, || time(&gpu, &pass, || ()))?);
    Ok(())
}

/// Milliseconds of a pass alone.
fn time(gpu: &Context, pass: &Pass, prepare: impl Fn()) -> Result<f64, GpuError> {
    let finish = |pass: Option<&Pass>| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if let Some(pass) = pass {
            pass.encode(&mut encoder, &mut PassTimer::off(), None);
        }
        gpu.queue.submit([encoder.finish()]);
        let wait = gpu.device.poll(PollType::wait_indefinitely());
        wait.map_err(|e| GpuError::ReadBack { label: "nothing".to_owned(), reason: e.to_string() })
    };
    prepare();
    finish(None)?;
    let start = Instant::now();
    finish(Some(pass))?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

fn median(repeats: usize, run: impl Fn() -> Result<f64, GpuError>) -> Result<f64, GpuError> {
    let mut times = (0..repeats).map(|_| run()).collect::<Result<Vec<_>, _>>()?;
    times.sort_by(f64::total_cmp);
    Ok(times[repeats / 2])
}
