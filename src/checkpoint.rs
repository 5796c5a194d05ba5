//! Checkpoints: a film with all its nodes and a header that says what it is of,
//! in one file that is complete or not there, and found out when it is damaged.
//!
//! All numbers are little-endian. `MAGIC`; the entries of the header (count u32,
//! then for each its name, a tag byte, and text or the bits of a double; texts
//! are a length u32 and UTF-8); window x0, y0, x1, y1, frame width, height and
//! whether there are sums of the first hit, log₂ of the samples of a block (u32 each); samples of the pilot (u64) and the
//! exponents of the pixels (count u32, 0 or that of the pixels, and a byte each); the nodes (count u32, then
//! for each its first sample u64, level u32 and floats); SHA-256 of all before.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;
use std::thread::{self, ScopedJoinHandle};

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::film::{Allotment, Film};
use crate::image_io::{Metadata, Value, write_with};
use crate::settings::{Crop, MAX_SIDE};

/// Of every checkpoint; the last byte counts up when the format changes.
const MAGIC: [u8; 16] = *b"etendue\0chkpt\0\0\x05";
/// Bytes of a SHA-256.
const DIGEST: u64 = 32;

/// Bytes of floats that are converted at a time.
const PART: usize = 1 << 16;

const TEXT: u8 = 0;
const NUMBER: u8 = 1;

/// Writes a checkpoint, atomically.
///
/// # Errors
/// [`Error::Io`]; an older checkpoint is then intact.
pub fn write(path: &Path, header: &Metadata, film: &Film) -> Result<()> {
    write_with(path, &mut |file| {
        let mut to = BufWriter::new(file);
        // summed up beside the writing: each takes about as long
        let sum = thread::scope(|scope| {
            let summing = thread::Builder::new().spawn_scoped(scope, || checksum(header, film));
            write_content(&mut to, header, film)?;
            match summing.map(ScopedJoinHandle::join) {
                Ok(Ok(sum)) => sum,
                // no thread to be had
                _ => checksum(header, film),
            }
        })?;
        to.write_all(&sum)?;
        to.flush()
    })
}

fn checksum(header: &Metadata, film: &Film) -> io::Result<[u8; DIGEST as usize]> {
    let mut to = Summing(Sha256::new());
    write_content(&mut to, header, film)?;
    Ok(to.0.finalize().into())
}

fn write_content(to: &mut dyn Write, header: &Metadata, film: &Film) -> io::Result<()> {
    to.write_all(&MAGIC)?;
    write_header(to, header)?;
    write_film(to, film)
}

/// Reads a checkpoint. Nothing larger than the file is allocated, whatever it claims.
///
/// # Errors
/// [`Error::Io`] when it cannot be read, [`Error::Image`] when it is damaged or no checkpoint.
pub fn read(path: &Path) -> Result<(Metadata, Film)> {
    let fail = |source: io::Error| match source.kind() {
        io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => Error::Image {
            path: path.to_owned(),
            what: format!("damaged, or no checkpoint: {source}"),
        },
        _ => Error::Io {
            action: "read",
            path: path.to_owned(),
            source,
        },
    };
    let file = File::open(path).map_err(fail)?;
    let length = file.metadata().map_err(fail)?.len();
    parse(BufReader::new(file), length).map_err(fail)
}

fn write_header(to: &mut dyn Write, header: &Metadata) -> io::Result<()> {
    write_u32(to, header.len() as u32)?;
    for (name, value) in header {
        write_text(to, name)?;
        match value {
            Value::Text(text) => {
                to.write_all(&[TEXT])?;
                write_text(to, text)?;
            }
            Value::Number(number) => {
                to.write_all(&[NUMBER])?;
                to.write_all(&number.to_bits().to_le_bytes())?;
            }
        }
    }
    Ok(())
}

fn write_film(to: &mut dyn Write, film: &Film) -> io::Result<()> {
    let Crop { x0, y0, x1, y1 } = film.window();
    let (width, height) = film.full_size();
    let aovs = film.has_aovs().into();
    for number in [x0, y0, x1, y1, width, height, aovs, film.block_level()] {
        write_u32(to, number)?;
    }
    let exponents = film.allotment().exponents();
    to.write_all(&film.allotment().pilot().to_le_bytes())?;
    write_u32(to, exponents.len() as u32)?;
    to.write_all(exponents)?;
    write_u32(to, film.nodes().count() as u32)?;
    for (first, level, values) in film.nodes() {
        to.write_all(&first.to_le_bytes())?;
        write_u32(to, level)?;
        let mut bytes = [0; PART];
        for part in values.chunks(PART / 4) {
            let bytes = &mut bytes[..part.len() * 4];
            for (bytes, value) in bytes.chunks_exact_mut(4).zip(part) {
                bytes.copy_from_slice(&value.to_le_bytes());
            }
            to.write_all(bytes)?;
        }
    }
    Ok(())
}

fn write_u32(to: &mut dyn Write, number: u32) -> io::Result<()> {
    to.write_all(&number.to_le_bytes())
}

fn write_text(to: &mut dyn Write, text: &str) -> io::Result<()> {
    write_u32(to, text.len() as u32)?;
    to.write_all(text.as_bytes())
}

fn parse(file: impl Read, length: u64) -> io::Result<(Metadata, Film)> {
    let left = length.checked_sub(DIGEST).ok_or_else(|| bad("too short"))?;
    let mut from = Source {
        inner: file,
        sum: Sha256::new(),
        left,
    };
    if from.array()? != MAGIC {
        return Err(bad("it does not start like one of this version"));
    }
    let header = read_header(&mut from)?;
    let film = read_film(&mut from)?;
    if from.left > 0 {
        return Err(bad("more bytes than it tells of"));
    }
    let sum = from.sum.finalize();
    let mut stored = [0; DIGEST as usize];
    from.inner.read_exact(&mut stored)?;
    if stored != sum[..] {
        return Err(bad("its checksum differs"));
    }
    Ok((header, film))
}

fn read_header(from: &mut Source<impl Read>) -> io::Result<Metadata> {
    let mut header = Metadata::new();
    for _ in 0..from.u32()? {
        let name = from.text()?;
        let [tag] = from.array()?;
        let value = match tag {
            TEXT => Value::Text(from.text()?),
            NUMBER => Value::Number(f64::from_bits(u64::from_le_bytes(from.array()?))),
            _ => return Err(bad("an entry of unknown type")),
        };
        header.insert(name, value);
    }
    Ok(header)
}

fn read_film(from: &mut Source<impl Read>) -> io::Result<Film> {
    let mut numbers = [0; 8];
    for number in &mut numbers {
        *number = from.u32()?;
    }
    let [x0, y0, x1, y1, width, height, aovs, block_level] = numbers;
    let fits = x0 < x1 && y0 < y1 && x1 <= width && y1 <= height;
    if !fits || width.max(height) > MAX_SIDE || aovs > 1 || block_level > 63 {
        return Err(bad("impossible windows"));
    }
    let window = Crop { x0, y0, x1, y1 };
    let mut film = Film::new(window, (width, height), aovs == 1).with_blocks(block_level);
    let pixels = u64::from(x1 - x0) * u64::from(y1 - y0);
    let count = pixels * film.floats_per_pixel() as u64;
    film = film.with_allotment(read_allotment(from, pixels)?);
    for _ in 0..from.u32()? {
        let first = u64::from_le_bytes(from.array()?);
        let level = from.u32()?;
        let values = from.floats(count)?;
        film.add(first, level, values)
            .map_err(|error| bad(&error.to_string()))?;
    }
    Ok(film)
}

fn read_allotment(from: &mut Source<impl Read>, pixels: u64) -> io::Result<Allotment> {
    let pilot = u64::from_le_bytes(from.array()?);
    let count = u64::from(from.u32()?);
    if count != 0 && count != pixels {
        return Err(bad("exponents of another window"));
    }
    let mut exponents = vec![0; from.claim(count)?];
    from.fill(&mut exponents)?;
    if exponents.iter().any(|&e| e > Allotment::MOST) {
        return Err(bad("impossible exponents"));
    }
    Ok(Allotment::from_exponents(exponents).with_pilot(pilot))
}

fn bad(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// Sums bytes up.
struct Summing(Sha256);

impl Write for Summing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What is left of a file before its checksum.
struct Source<R> {
    inner: R,
    sum: Sha256,
    left: u64,
}

impl<R: Read> Source<R> {
    fn fill(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.left = self
            .left
            .checked_sub(bytes.len() as u64)
            .ok_or_else(|| bad("it ends early"))?;
        self.inner.read_exact(bytes)?;
        self.sum.update(bytes);
        Ok(())
    }

    fn array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn u32(&mut self) -> io::Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    /// Refuses what the file cannot hold, before there is memory for it.
    fn claim(&self, bytes: u64) -> io::Result<usize> {
        if bytes > self.left {
            return Err(bad("it ends early"));
        }
        usize::try_from(bytes).map_err(|_| bad("too large for this machine"))
    }

    fn text(&mut self) -> io::Result<String> {
        let length = self.u32()?;
        let mut bytes = vec![0; self.claim(length.into())?];
        self.fill(&mut bytes)?;
        String::from_utf8(bytes).map_err(|_| bad("text that is not UTF-8"))
    }

    fn floats(&mut self, count: u64) -> io::Result<Vec<f32>> {
        let bytes = count.checked_mul(4).ok_or_else(|| bad("it ends early"))?;
        self.claim(bytes)?;
        let mut values = Vec::with_capacity(count as usize);
        let mut buffer = [0; PART];
        let mut left = bytes as usize;
        while left > 0 {
            let part = left.min(buffer.len());
            self.fill(&mut buffer[..part])?;
            let floats = buffer[..part].chunks_exact(4);
            values.extend(floats.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
            left -= part;
        }
        Ok(values)
    }
}
