//! `web`: the page of `examples/live`, and its run in a browser that nobody sees.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use clap::Parser;
use glam::Vec3;
use indirect_accel::{Accel, BuildPreset, cast};
use indirect_core::Image;
use indirect_scene::exr;
use serde::Deserialize;

use crate::cli::{RenderArgs, WebArgs};
use crate::failure::{Failure, Outcome};
use crate::{render, say, setup};

const TARGET: &str = "wasm32-unknown-unknown";

/// Files of the page beside those that are built.
const PAGE: [&str; 2] = ["index.html", "live.mjs"];

/// Pixels along each side of the pictures that are compared.
const SIZE: u32 = 96;

/// Most that a browser may take for all of them.
const PATIENCE: Duration = Duration::from_secs(180);

/// How far a picture may be from that of `render`, root mean squares.
const MOST: f64 = 0.01;

/// Share of the pixels that may see another triangle: rasterisers round silhouettes either way.
const SILHOUETTES: f64 = 0.02;

/// Why there is nothing to run, or why what ran is not right.
pub(crate) enum Ended {
    Skipped(String),
    Failed(Failure),
}

impl From<Failure> for Ended {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

pub(crate) fn run(args: &WebArgs) -> Outcome {
    let folder = build()?;
    say(format!("{}: the page", folder.display()));
    if args.serve {
        let listener = listen(args.port)?;
        let address = listener.local_addr().map_err(|e| Failure::Check(e.to_string()))?;
        say(format!("http://{address}/index.html; end with Ctrl-C"));
        listener.incoming().flatten().for_each(|stream| {
            // One that hangs up early is no loss.
            let _ = answer(stream, &folder);
        });
    }
    Ok(())
}

/// Builds the page into `target/web`.
fn build() -> Outcome<PathBuf> {
    let (root, folder) = (crate::root(), crate::target().join("web"));
    if !setup::rustup_has(TARGET) {
        return Err(Failure::Check(format!("run `rustup target add {TARGET}` first")));
    }
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["build", "--release", "--quiet", "-p", "live", "--target", TARGET];
    succeed(Command::new(&cargo).args(arguments).current_dir(&root))?;
    let wasm = crate::target().join(TARGET).join("release/live.wasm");
    let bindgen = bindgen(&cargo)?;
    let mut command = Command::new(bindgen);
    command.args(["--target", "web", "--no-typescript", "--out-dir"]).arg(&folder).arg(wasm);
    succeed(&mut command)?;
    for name in PAGE {
        let from = root.join("examples/live/web").join(name);
        std::fs::copy(&from, folder.join(name)).map_err(|e| Failure::file(&from, e))?;
    }
    Ok(folder)
}

/// The tool that writes the JavaScript beside the module: of the version that the lock file has, from the path or built once.
fn bindgen(cargo: &std::ffi::OsStr) -> Outcome<PathBuf> {
    let lock = crate::root().join("Cargo.lock");
    let text = std::fs::read_to_string(&lock).map_err(|e| Failure::file(&lock, e))?;
    let entry = text.split("name = \"wasm-bindgen\"\nversion = \"").nth(1);
    let version = entry.and_then(|rest| rest.split('"').next());
    let version = version.ok_or_else(|| Failure::file(&lock, "names no wasm-bindgen"))?;
    let tools = crate::target().join("tools");
    let own = tools.join("bin/wasm-bindgen");
    for candidate in [PathBuf::from("wasm-bindgen"), own.clone()] {
        let found = Command::new(&candidate).arg("--version").output();
        if found.is_ok_and(|out| String::from_utf8_lossy(&out.stdout).contains(version)) {
            return Ok(candidate);
        }
    }
    say(format!("building wasm-bindgen {version} once, a few minutes"));
    let mut command = Command::new(cargo);
    command.args(["install", "--quiet", "wasm-bindgen-cli", "--version", version, "--root"]).arg(&tools);
    // A folder of its own: the workspace's configuration and target are not meant for it.
    succeed(command.current_dir(std::env::temp_dir()))?;
    Ok(own)
}

fn succeed(command: &mut Command) -> Outcome {
    let name = command.get_program().display().to_string();
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::Check(format!("{name} ended with {status}"))),
        Err(e) => Err(Failure::Check(format!("{name}: {e}"))),
    }
}

fn listen(port: u16) -> Outcome<TcpListener> {
    TcpListener::bind(("127.0.0.1", port)).map_err(|e| Failure::Check(format!("127.0.0.1:{port}: {e}")))
}

/// Answers one request with a file of `folder`; returns what was posted.
fn answer(mut stream: TcpStream, folder: &Path) -> std::io::Result<Option<Vec<u8>>> {
    stream.set_read_timeout(Some(Duration::from_secs(20)))?;
    let mut request = Vec::new();
    let mut chunk = [0; 1 << 16];
    let body = loop {
        let read = stream.read(&mut chunk)?;
        request.extend(&chunk[..read]);
        if let Some(end) = request.windows(4).position(|w| w == b"\r\n\r\n") {
            break end + 4;
        }
        if read == 0 || request.len() > 1 << 16 {
            return Ok(None);
        }
    };
    let head = String::from_utf8_lossy(&request[..body]).into_owned();
    let (method, path) =
        head.split_once(' ').map_or(("", "/"), |(m, rest)| (m, rest.split(' ').next().unwrap_or("/")));
    if method == "POST" {
        let length =
            head.lines().find_map(|l| l.to_lowercase().strip_prefix("content-length:")?.trim().parse().ok());
        let length: usize = length.unwrap_or(0);
        while request.len() < body + length.min(1 << 26) {
            let read = stream.read(&mut chunk)?;
            if read == 0 {
                break;
            }
            request.extend(&chunk[..read]);
        }
        stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")?;
        return Ok(Some(request.split_off(body)));
    }
    // Only names of files: nothing outside of the folder can be asked for.
    let name = path.split('?').next().unwrap_or("/").trim_start_matches('/');
    let name = if name.is_empty() { "index.html" } else { name };
    let file = Path::new(name).file_name().filter(|n| n.to_str() == Some(name)).map(|n| folder.join(n));
    let kind = match Path::new(name).extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html",
        Some("js" | "mjs") => "text/javascript",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    };
    match file.and_then(|f| std::fs::read(f).ok()) {
        Some(bytes) => {
            let length = bytes.len();
            write!(
                stream,
                "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
            )?;
            stream.write_all(&bytes)?;
        }
        None => {
            stream.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")?
        }
    }
    Ok(None)
}

/// What the page found of one technique.
#[derive(Debug, Deserialize)]
struct Picture {
    name: String,
    settings: String,
    size: u32,
    image: Vec<f32>,
    triangles: Vec<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Posted {
    Pictures(Vec<Picture>),
    Error { error: String },
}

/// Every technique as WebAssembly on a browser's WebGPU, its shaders through the browser's compiler, each picture beside that of `render`.
pub(crate) fn check() -> Result<(), Ended> {
    if !setup::rustup_has(TARGET) {
        return Err(Ended::Skipped(format!("run `rustup target add {TARGET}` for this step")));
    }
    let Some(browser) = browser() else {
        return Err(Ended::Skipped("no Chromium is installed: apt-get install chromium".to_owned()));
    };
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    if let Err(f) = bindgen(&cargo) {
        return Err(Ended::Skipped(format!("wasm-bindgen cannot be had: {}", f.line())));
    }
    let folder = build()?;
    let posted = visit(&browser, &folder)?;
    let pictures = match serde_json::from_slice(&posted)
        .map_err(|e| Failure::Check(format!("the page's answer: {e}")))?
    {
        Posted::Pictures(pictures) => pictures,
        Posted::Error { error } => return Err(Failure::Check(format!("in the browser: {error}")).into()),
    };
    if pictures.is_empty() {
        return Err(Failure::Check("the page made no picture".to_owned()).into());
    }
    let scene = indirect_scene::fixtures::cornell(indirect_scene::fixtures::CornellLight::Spot);
    let accel = Accel::build(&scene, BuildPreset::Fast);
    let seen = cast::gbuffer(&accel, &scene.cameras[0].view([SIZE; 2]), [SIZE; 2]);
    for picture in &pictures {
        let (mut found, wanted) = (picture.image(), rendered(picture)?);
        let mut silhouettes = 0;
        let pixels =
            found.pixels.iter_mut().zip(&wanted.pixels).zip(picture.triangles.iter().zip(&seen.triangle));
        for ((found, wanted), _) in pixels.filter(|(_, (theirs, ours))| theirs != ours) {
            *found = *wanted;
            silhouettes += 1;
        }
        let off = testkit::own_renderer::relative_rms(&found, &wanted);
        let (percent, name) = (100.0 * off, &picture.name);
        let line = format!(
            "{name}: {percent:.3} % rms from `render`, beside {silhouettes} silhouettes of {}",
            seen.len()
        );
        let few = f64::from(silhouettes) <= SILHOUETTES * seen.len() as f64
            && picture.triangles.len() == seen.len();
        if !(off <= MOST && few && wanted.mean().max_element() > 0.0) {
            return Err(Failure::Check(line).into());
        }
        say(line);
    }
    Ok(())
}

impl Picture {
    fn image(&self) -> Image {
        let pixels = self.image.chunks_exact(4).map(|p| Vec3::new(p[0], p[1], p[2])).collect();
        Image { size: [self.size; 2], pixels }
    }
}

/// `render` as the command line parses it.
#[derive(Debug, Parser)]
struct Render {
    #[command(flatten)]
    args: RenderArgs,
}

/// The same by `render`.
fn rendered(picture: &Picture) -> Outcome<Image> {
    let folder = crate::target().join("web-check");
    std::fs::create_dir_all(&folder).map_err(|e| Failure::file(&folder, e))?;
    let out = folder.join(format!("{}.exr", picture.name));
    let path = out.display().to_string();
    let size = format!("{0}x{0}", picture.size);
    let mut words =
        vec!["render", "cornell_spot", "--component", "indirect", "--size", &size, "--out", &path];
    words.extend(["--technique", &picture.name]);
    picture.settings.split(',').filter(|s| !s.is_empty()).for_each(|s| words.extend(["--set", s]));
    let render = Render::try_parse_from(words).map_err(|e| Failure::Check(e.to_string()))?;
    render::run(&render.args)?;
    exr::read_rgb(&out).map_err(|e| Failure::Check(e.to_string()))
}

fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let runs = |name: &&&str| {
        let mut command = Command::new(name);
        command
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    names.iter().find(runs).map(PathBuf::from)
}

/// Ends a browser that nobody waits for.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Opens the page in its checking mode and returns what it posts; an error where the console says anything.
fn visit(browser: &Path, folder: &Path) -> Outcome<Vec<u8>> {
    let listener = listen(0)?;
    listener.set_nonblocking(true).map_err(|e| Failure::Check(e.to_string()))?;
    let port = listener.local_addr().map_err(|e| Failure::Check(e.to_string()))?.port();
    let profile = tempfile::tempdir().map_err(|e| Failure::Check(e.to_string()))?;
    let log = profile.path().join("log");
    let file = std::fs::File::create(&log).map_err(|e| Failure::file(&log, e))?;
    let mut command = Command::new(browser);
    command
        .args([
            "--headless",
            "--no-sandbox",
            "--no-first-run",
            "--disable-quic",
            "--disable-background-networking",
        ])
        .args(["--disable-component-update", "--disable-sync", "--enable-logging=stderr"])
        // SwiftShader, so that machines without a GPU have WebGPU and a canvas that it can draw to.
        .args(["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--use-vulkan=swiftshader"])
        .args([
            "--enable-features=Vulkan",
            "--use-angle=swiftshader",
            "--ignore-gpu-blocklist",
            "--disable-vulkan-surface",
        ])
        .arg(format!("--user-data-dir={}", profile.path().join("profile").display()))
        .arg(format!("http://127.0.0.1:{port}/index.html?check={SIZE}"))
        .stdout(Stdio::null())
        .stderr(file);
    let running =
        Running(command.spawn().map_err(|e| Failure::Check(format!("{}: {e}", browser.display())))?);
    let start = Instant::now();
    let mut posted = None;
    while posted.is_none() && start.elapsed() < PATIENCE {
        match listener.accept() {
            Ok((stream, _)) => {
                let blocking = stream.set_nonblocking(false);
                posted = blocking.and_then(|()| answer(stream, folder)).unwrap_or(None);
            }
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
    drop(running);
    let text = String::from_utf8_lossy(&std::fs::read(&log).unwrap_or_default()).into_owned();
    let console: Vec<_> = text.lines().filter(|l| l.contains(":CONSOLE:")).take(3).collect();
    let posted = posted.ok_or_else(|| {
        Failure::Check(format!(
            "the browser said nothing within {} s; {}",
            PATIENCE.as_secs(),
            console.join("; ")
        ))
    })?;
    // What the page itself threw is in what it posted, and says more.
    if posted.first() == Some(&b'[') && !console.is_empty() {
        return Err(Failure::Check(format!("on the browser's console: {}", console.join("; "))));
    }
    Ok(posted)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(request: &str, folder: &Path) -> (Option<Vec<u8>>, String) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        client.write_all(request.as_bytes()).unwrap();
        let posted = answer(listener.accept().unwrap().0, folder).unwrap();
        let mut reply = String::new();
        client.read_to_string(&mut reply).unwrap();
        (posted, reply)
    }

    #[test]
    fn files_of_the_folder_are_served_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("web")).unwrap();
        std::fs::write(folder.path().join("secret.txt"), "secret").unwrap();
        std::fs::write(folder.path().join("web/index.html"), "page").unwrap();
        let web = folder.path().join("web");
        for path in ["/", "/index.html", "/index.html?check=8"] {
            let (posted, reply) = ask(&format!("GET {path} HTTP/1.1\r\n\r\n"), &web);
            assert!(
                posted.is_none() && reply.starts_with("HTTP/1.1 200") && reply.ends_with("page"),
                "{path}: {reply}"
            );
        }
        for path in ["/../secret.txt", "/..%2fsecret.txt", "/web/index.html", "/nothing.js", "/.."] {
            let (_, reply) = ask(&format!("GET {path} HTTP/1.1\r\n\r\n"), &web);
            assert!(reply.starts_with("HTTP/1.1 404") && !reply.contains("secret"), "{path}: {reply}");
        }
        let (posted, _) = ask("POST /result HTTP/1.1\r\ncontent-length: 5\r\n\r\nhello", &web);
        assert_eq!(posted.as_deref(), Some(&b"hello"[..]));
    }
}
