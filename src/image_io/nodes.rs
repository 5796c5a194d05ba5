//! Films in images: a mean is rounded, so images that are to be merged carry the
//! sums themselves, a layer `node.FIRST.LEVEL` for each node of the film.

use std::ops::Range;

use super::{Channel, Image, Value};
use crate::film::{Film, pair_level};

/// Before the names of the layers.
const PREFIX: &str = "node.";

/// The floats of a pixel in a node, in order; the first nine where a film has no sums of the first hit.
const PARTS: [&str; 18] = [
    "sum.R",
    "sum.G",
    "sum.B",
    "deviations.R",
    "deviations.G",
    "deviations.B",
    "between.R",
    "between.G",
    "between.B",
    "albedo.R",
    "albedo.G",
    "albedo.B",
    "normal.X",
    "normal.Y",
    "normal.Z",
    "depth.Z",
    "coverage",
    "dropped",
];

impl Image {
    /// Entry of the header: number of samples of the blocks that two nets are dealt out in, a power of two; 1: samples are independent.
    pub const BLOCK: &'static str = "stderr.block";
    /// Entry of the header: number of independent parts that standard errors come from.
    pub const PARTS: &'static str = "stderr.parts";
    /// Header names of the size of the blocks whose pixels share what their paths find, and are therefore wrong together.
    pub const SHARE: [&'static str; 2] = ["share.width", "share.height"];

    /// Adds the nodes of the film that the image was made of.
    pub fn push_nodes(&mut self, film: &Film) {
        let stride = film.floats_per_pixel();
        for (first, level, values) in film.nodes() {
            for (offset, part) in PARTS[..stride].iter().enumerate() {
                self.channels.push(Channel {
                    name: format!("{PREFIX}{first}.{level}.{part}"),
                    values: values[offset..].iter().step_by(stride).copied().collect(),
                });
            }
        }
    }

    /// The film that the image was made of, if it has nodes.
    ///
    /// # Errors
    /// What is wrong: there are no nodes, they are not complete, or the picture is not theirs.
    pub fn film(&self) -> Result<Film, String> {
        let mut nodes: Vec<(u64, u32)> = Vec::new();
        for channel in &self.channels {
            if let Some(name) = channel.name.strip_prefix(PREFIX) {
                let node = node(name).ok_or_else(|| format!("{} is no node", channel.name))?;
                nodes.push(node);
            }
        }
        nodes.sort_unstable();
        nodes.dedup();
        let Some((first, level)) = nodes.first() else {
            return Err(String::from(
                "has no sums to merge: those are stored where --samples was given",
            ));
        };
        let last = PARTS[PARTS.len() - 1];
        let aovs = self
            .channel(&format!("{PREFIX}{first}.{level}.{last}"))
            .is_some();
        let mut film = Film::new(self.window, self.full, aovs).with_blocks(self.block_level());
        for (first, level) in nodes {
            let values = self.node_values(first, level, film.floats_per_pixel())?;
            film.add(first, level, values).map_err(|e| e.to_string())?;
        }
        let same = |a: &[f32; 3], b: &[f32; 3]| a.map(f32::to_bits) == b.map(f32::to_bits);
        let (is, should) = (self.rgb().unwrap_or_default(), film.mean());
        if is.len() != should.len() || !is.iter().zip(&should).all(|(a, b)| same(a, b)) {
            return Err(String::from("R, G, B are not the mean of its sums"));
        }
        Ok(film)
    }

    /// log₂ of the samples of a block, as the header tells; 0 where it does not.
    pub fn block_level(&self) -> u32 {
        match self.metadata.get(Self::BLOCK) {
            Some(Value::Number(count)) if *count >= 1.0 => (*count as u64).ilog2(),
            _ => 0,
        }
    }

    /// The pairs of nets that hold some samples.
    pub fn nets_around(&self, samples: Range<u64>) -> Range<u64> {
        let size = 1_u64 << pair_level(self.block_level());
        let (start, last) = (samples.start, samples.end.saturating_sub(1));
        start - start % size..(last - last % size).saturating_add(size)
    }

    /// The independent parts that standard errors come from, where the header tells.
    pub fn parts(&self) -> Option<f64> {
        match self.metadata.get(Self::PARTS) {
            Some(Value::Number(parts)) if *parts >= 1.0 => Some(*parts),
            _ => None,
        }
    }

    /// Columns and rows of the blocks of pixels whose errors go together; 1 where each has its own.
    pub fn shared(&self) -> [usize; 2] {
        Self::SHARE.map(|name| match self.metadata.get(name) {
            Some(Value::Number(n)) if *n >= 1.0 => *n as usize,
            _ => 1,
        })
    }

    /// The floats of a node, pixel by pixel.
    fn node_values(&self, first: u64, level: u32, stride: usize) -> Result<Vec<f32>, String> {
        let (width, height) = self.size();
        let mut values = vec![0.0; width * height * stride];
        for (offset, part) in PARTS[..stride].iter().enumerate() {
            let name = format!("{PREFIX}{first}.{level}.{part}");
            let channel = self.channel(&name);
            let channel = channel.ok_or_else(|| format!("{name} is missing"))?;
            for (to, &from) in values[offset..].iter_mut().step_by(stride).zip(channel) {
                *to = from;
            }
        }
        Ok(values)
    }
}

/// First sample and level of `FIRST.LEVEL.PART`.
fn node(name: &str) -> Option<(u64, u32)> {
    let (first, rest) = name.split_once('.')?;
    let (level, part) = rest.split_once('.')?;
    let known = PARTS.contains(&part);
    known.then_some((first.parse().ok()?, level.parse().ok()?))
}
