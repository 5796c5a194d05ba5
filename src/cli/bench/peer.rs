//! Other renderers: scripts that wait for requests, a JSON object a line, and answer each with one.
//! benches/peers/README.md describes what is said.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use serde::Deserialize;
use serde_json::json;

use super::error::Picture;

/// A script that runs.
pub struct Peer {
    /// Of the script.
    pub script: String,
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    pixels: usize,
    /// Of the renderer, with version and variant.
    pub name: String,
    /// Seconds from its start until it could answer.
    pub process: f64,
}

/// A scene that a peer is ready to render.
#[derive(Deserialize)]
pub struct Loaded {
    /// That it can use; each makes a contender.
    pub samplers: Vec<String>,
    /// Seconds to convert, load and build.
    pub build: f64,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Answer {
    Ready { name: String },
    Loaded(Loaded),
    Rendered { seconds: f64, spp: u64 },
    Cannot(String),
}

/// The scripts of a folder, in alphabetical order.
pub fn scripts(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder)
        .with_context(|| format!("look for peers in {}", folder.display()))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_peer = |path: &PathBuf| path.to_string_lossy().ends_with("_peer.py");
    let mut scripts: Vec<PathBuf> = paths.filter(is_peer).collect();
    scripts.sort();
    if scripts.is_empty() {
        bail!("look for peers in {}: no *_peer.py", folder.display());
    }
    Ok(scripts)
}

impl Peer {
    pub fn start(python: &str, script: &Path) -> Result<Self> {
        let start = Instant::now();
        let mut child = Command::new(python)
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("run {python} {}", script.display()))?;
        let input = child.stdin.take().context("the pipe to a peer")?;
        let output = child.stdout.take().context("the pipe from a peer")?;
        let name = script.file_name().unwrap_or_default();
        let mut peer = Self {
            script: name.to_string_lossy().into_owned(),
            child,
            input,
            output: BufReader::new(output),
            pixels: 0,
            name: String::new(),
            process: 0.0,
        };
        match peer.ask(&json!({ "hello": {} }))? {
            Answer::Ready { name } => {
                peer.name = name;
                peer.process = start.elapsed().as_secs_f64();
            }
            _ => bail!("{} answers another question", peer.script),
        }
        Ok(peer)
    }

    /// What it says of a scene; an error also where it cannot render it as we do.
    pub fn load(
        &mut self,
        scene: &Path,
        (width, height): (u32, u32),
        max_depth: u32,
    ) -> Result<Loaded> {
        let scene = scene.canonicalize()?;
        self.pixels = (width * height) as usize;
        let request = json!({ "load": {
            "scene": scene, "width": width, "height": height, "max_depth": max_depth,
        }});
        match self.ask(&request)? {
            Answer::Loaded(loaded) => Ok(loaded),
            Answer::Cannot(reason) => bail!("{reason}"),
            _ => bail!("{} answers another question", self.script),
        }
    }

    /// The picture, the seconds that it took, and its samples: some samplers round them.
    pub fn render(
        &mut self,
        sampler: &str,
        spp: u64,
        seed: u64,
        scratch: &Path,
    ) -> Result<(Picture, f64, u64)> {
        let request = json!({ "render": {
            "sampler": sampler, "spp": spp, "seed": seed, "file": scratch,
        }});
        let (seconds, spp) = match self.ask(&request)? {
            Answer::Rendered { seconds, spp } => (seconds, spp),
            Answer::Cannot(reason) => bail!("{reason}"),
            _ => bail!("{} answers another question", self.script),
        };
        let bytes = std::fs::read(scratch)
            .with_context(|| format!("read the picture of {}", self.script))?;
        std::fs::remove_file(scratch)?;
        let values: Vec<f32> = bytes
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect();
        let picture: Picture = values.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        if picture.len() != self.pixels {
            let count = picture.len();
            bail!("{} gives {count} pixels, not {}", self.script, self.pixels);
        }
        Ok((picture, seconds, spp))
    }

    fn ask(&mut self, request: &serde_json::Value) -> Result<Answer> {
        let gone = || anyhow!("{} ended without an answer", self.script);
        writeln!(self.input, "{request}").map_err(|_| gone())?;
        let mut line = String::new();
        if self.output.read_line(&mut line)? == 0 {
            return Err(gone());
        }
        serde_json::from_str(&line).with_context(|| format!("{} says {line:?}", self.script))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may be ended already; there is nobody to tell.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
