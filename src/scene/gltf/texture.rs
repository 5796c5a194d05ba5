//! Textures and samplers: each combination of image, sampler and colour space
//! becomes one [`Texture`]. Images are decoded at the end, on all cores.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::accessor::Buffers;
use super::json::{Root, Sampler, TextureInfo};
use super::resolve::Files;
use super::{Check, Limits, Warnings, get, image, quote};
use crate::scene::{Filter, Texels, Texture, TextureRef, Wrap};

/// How a material reads an image, which decides its colour space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum ColorSpace {
    /// RGB hold colours on the sRGB curve.
    Srgb,
    /// Plain numbers.
    Linear,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    image: u32,
    wrap: [Wrap; 2],
    filter: Filter,
    color_space: ColorSpace,
}

/// An image that is still to be decoded.
struct Pending<'a> {
    /// Its number in the file.
    image: u32,
    bytes: Cow<'a, [u8]>,
    header: image::Header,
    color_space: ColorSpace,
    /// The texture that it is for.
    texture: usize,
}

/// The textures that materials have asked for so far.
pub(super) struct Textures<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    /// The file's limits.
    pub limits: &'a Limits,
    texels: u64,
    known: HashMap<Key, u32>,
    /// Textures of each image.
    of_image: HashMap<u32, Vec<(ColorSpace, u32)>>,
    /// Those of [`Self::pending`] and of [`Self::copies`] have no texels yet.
    list: Vec<Texture>,
    pending: Vec<Pending<'a>>,
    /// Textures with the texels of earlier ones: (from, to).
    copies: Vec<(usize, usize)>,
}

impl<'a> Textures<'a> {
    /// No texture yet.
    pub fn new(root: &'a Root, buffers: &'a Buffers<'a>, limits: &'a Limits) -> Self {
        Self {
            root,
            buffers,
            limits,
            texels: 0,
            known: HashMap::new(),
            of_image: HashMap::new(),
            list: Vec::new(),
            pending: Vec::new(),
            copies: Vec::new(),
        }
    }

    /// Decodes all images; `cache` is a folder of those that were decoded before.
    pub fn finish(mut self, cache: Option<&Path>) -> Check<Vec<Texture>> {
        for (pending, texels) in self.pending.iter().zip(decode_all(&self.pending, cache)) {
            let texels = texels.map_err(|what| format!("images[{}]: {what}", pending.image))?;
            self.list[pending.texture].texels = texels;
        }
        for (from, to) in self.copies {
            self.list[to].texels = match (&self.list[from].texels, &self.list[to].texels) {
                (Texels::Rgba8 { data, .. }, Texels::Rgba8 { srgb, .. }) => Texels::Rgba8 {
                    data: data.clone(),
                    srgb: *srgb,
                },
                (texels, _) => texels.clone(),
            };
        }
        Ok(self.list)
    }

    /// How many texels the limit still allows.
    pub fn texels_left(&self) -> u64 {
        self.limits.texels - self.texels
    }

    /// A material's reference to a texture; `None` when there is none, or none that can be used.
    pub fn reference(
        &mut self,
        info: Option<&TextureInfo>,
        color_space: ColorSpace,
        user: &str,
        files: &mut Files,
        warnings: &mut Warnings,
    ) -> Check<Option<TextureRef>> {
        let Some(info) = info else {
            return Ok(None);
        };
        let index = info
            .index
            .ok_or_else(|| format!("{user}: index is missing"))?;
        let texture = get(&self.root.textures, index, "textures", user)?;
        let (uv_set, uv_transform) = coordinates(info, user)?;
        let Some(source) = texture.source else {
            warnings.push(format!(
                "{user} is left out: textures[{index}] has no image in a supported format"
            ));
            return Ok(None);
        };
        let from = format!("textures[{index}]");
        get(&self.root.images, source, "images", &from)?;
        let (wrap, filter) = match texture.sampler {
            None => Default::default(),
            Some(sampler) => {
                let settings = get(&self.root.samplers, sampler, "samplers", &from)?;
                sampler_settings(settings, &format!("samplers[{sampler}]"))?
            }
        };
        let key = Key {
            image: source,
            wrap,
            filter,
            color_space,
        };
        let texture = match self.known.get(&key) {
            Some(&texture) => texture,
            None => self.add(key, files)?,
        };
        Ok(Some(TextureRef {
            texture,
            uv_set,
            uv_transform,
        }))
    }

    fn add(&mut self, key: Key, files: &mut Files) -> Check<u32> {
        let index = self.list.len();
        let texture = match self.same_bits(&key) {
            Some(other) => self.copy(other, &key),
            None => self.announce(&key, files),
        };
        let texture = texture.map_err(|what| format!("images[{}]: {what}", key.image))?;
        self.texels += u64::from(texture.width) * u64::from(texture.height);
        self.list.push(texture);
        self.known.insert(key, index as u32);
        let of_image = self.of_image.entry(key.image).or_default();
        of_image.push((key.color_space, index as u32));
        Ok(index as u32)
    }

    /// A texture with the same image, whose texels do not depend on how they differ.
    fn same_bits(&self, key: &Key) -> Option<usize> {
        let others = self.of_image.get(&key.image)?.iter();
        let mut others = others.map(|&(color_space, index)| (color_space, index as usize));
        let is_same = |&(color_space, index): &(ColorSpace, usize)| {
            color_space == key.color_space
                || matches!(self.list[index].texels, Texels::Rgba8 { .. })
        };
        others.find(is_same).map(|(_, index)| index)
    }

    fn copy(&mut self, index: usize, key: &Key) -> Check<Texture> {
        let other = &self.list[index];
        let size = u64::from(other.width) * u64::from(other.height);
        image::check_total(size, self.texels_left(), self.limits.texels)?;
        self.copies.push((index, self.list.len()));
        let mut copy = Texture {
            wrap: key.wrap,
            filter: key.filter,
            ..other.clone()
        };
        if let Texels::Rgba8 { srgb, .. } = &mut copy.texels {
            *srgb = key.color_space == ColorSpace::Srgb;
        }
        Ok(copy)
    }

    /// A texture without its texels, and what they will be decoded from.
    fn announce(&mut self, key: &Key, files: &mut Files) -> Check<Texture> {
        let image = &self.root.images[key.image as usize];
        let user = format!("images[{}]", key.image);
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), None) => Cow::Owned(files.fetch(uri)?),
            (None, Some(view)) => Cow::Borrowed(self.buffers.view(view, &user)?.0),
            _ => return Err(String::from("needs exactly one of uri and bufferView")),
        };
        let header = image::header(
            &bytes,
            image.mime_type.as_deref(),
            self.limits.image_side,
            (self.texels_left(), self.limits.texels),
        )?;
        self.pending.push(Pending {
            image: key.image,
            bytes,
            header,
            color_space: key.color_space,
            texture: self.list.len(),
        });
        let is_file = |uri: &&String| !uri.starts_with("data:");
        let name = image.name.as_ref().or(image.uri.as_ref().filter(is_file));
        let srgb = key.color_space == ColorSpace::Srgb;
        Ok(Texture {
            name: name.cloned().unwrap_or(user),
            width: header.width,
            height: header.height,
            texels: match header.is_wide {
                true => Texels::Rgba16(Vec::new()),
                false => Texels::Rgba8 {
                    data: Vec::new(),
                    srgb,
                },
            },
            wrap: key.wrap,
            filter: key.filter,
        })
    }
}

/// The texels of each image, in order.
fn decode_all(images: &[Pending], cache: Option<&Path>) -> Vec<Check<Texels>> {
    // Asking for the number of cores opens files of the system, so only where it matters.
    let workers = match images.len() {
        0 | 1 => 1,
        many => thread::available_parallelism().map_or(1, |cores| cores.get().min(many)),
    };
    let next = AtomicUsize::new(0);
    let work = || -> Vec<_> {
        let taken = std::iter::from_fn(|| {
            let index = next.fetch_add(1, Ordering::Relaxed);
            images.get(index).map(|image| (index, image))
        });
        let texels = |p: &Pending| image::texels(&p.bytes, &p.header, p.color_space, cache);
        taken.map(|(index, image)| (index, texels(image))).collect()
    };
    let mut all: Vec<_> = thread::scope(|scope| {
        let others: Vec<_> = (1..workers).map(|_| scope.spawn(work)).collect();
        let mut all = work();
        for other in others {
            // A decoder that panics in a thread panics here.
            all.extend(
                other
                    .join()
                    .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            );
        }
        all
    });
    all.sort_unstable_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, texels)| texels).collect()
}

/// The set of coordinates and the matrix on them.
fn coordinates(info: &TextureInfo, user: &str) -> Check<(u32, [[f32; 3]; 2])> {
    let transform = info.extensions.transform.as_ref();
    let set = transform
        .and_then(|t| t.tex_coord)
        .unwrap_or(info.tex_coord);
    if set > 1 {
        return Err(format!(
            "{user}: texCoord {set} is not supported, only 0 and 1 are"
        ));
    }
    let [offset, scale, angle] = match transform {
        None => return Ok((set, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])),
        Some(t) => [
            t.offset.unwrap_or([0.0; 2]),
            t.scale.unwrap_or([1.0; 2]),
            [t.rotation.unwrap_or(0.0); 2],
        ],
    };
    let (sin, cos) = angle[0].sin_cos();
    // translation · rotation · scale. v points down in glTF, so a turn counter-clockwise
    // on the image has the minus sign below the diagonal (KHR_texture_transform, README,
    // as corrected by KhronosGroup/glTF#1624).
    let rows = [
        [cos * scale[0], sin * scale[1], offset[0]],
        [-sin * scale[0], cos * scale[1], offset[1]],
    ];
    let rows = rows.map(|row| row.map(|x| x as f32));
    if rows.iter().flatten().all(|x| x.is_finite()) {
        Ok((set, rows))
    } else {
        Err(format!("{user}: KHR_texture_transform is not finite"))
    }
}

fn sampler_settings(sampler: &Sampler, user: &str) -> Check<([Wrap; 2], Filter)> {
    let wrap = |mode: Option<u32>, name: &str| match mode {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33648) => Ok(Wrap::Mirror),
        Some(33071) => Ok(Wrap::Clamp),
        Some(mode) => Err(format!("{user}: {name} {mode} is not known")),
    };
    if let Some(filter) = sampler.min_filter {
        if !matches!(filter, 9728 | 9729 | 9984..=9987) {
            return Err(format!("{user}: minFilter {filter} is not known"));
        }
    }
    let filter = match sampler.mag_filter {
        None | Some(9729) => Filter::Linear,
        Some(9728) => Filter::Nearest,
        Some(filter) => return Err(format!("{user}: magFilter {filter} is not known")),
    };
    let wraps = [
        wrap(sampler.wrap_s, "wrapS")?,
        wrap(sampler.wrap_t, "wrapT")?,
    ];
    Ok((wraps, filter))
}

/// Names a material for messages.
pub(super) fn material_label(index: usize, name: Option<&String>) -> String {
    match name {
        Some(name) => format!("materials[{index}] ({})", quote(name)),
        None => format!("materials[{index}]"),
    }
}
