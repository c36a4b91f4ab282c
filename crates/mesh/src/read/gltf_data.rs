//! Numeric data of a glTF file: buffers and accessors.
//!
//! Every range is checked against the available bytes before it is read.

use std::borrow::Cow;

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use glam::DVec3;
use gltf::{
    Accessor, Document,
    accessor::{DataType, Dimensions},
    buffer::Source,
};

use super::{beside::Beside, gltf::content};
use crate::MeshError;

/// Decoder for data URIs, whose padding may be missing.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Bytes of all buffers.
pub struct Data<'a> {
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Data<'a> {
    /// Loads the buffers from the GLB chunk, data URIs or files.
    pub fn load(
        file: &str,
        document: &Document,
        blob: Option<&'a [u8]>,
        beside: &Beside,
    ) -> Result<Self, MeshError> {
        let mut buffers = Vec::new();
        for buffer in document.buffers() {
            let place = format!("buffer {}", buffer.index());
            let bytes: Cow<[u8]> = match buffer.source() {
                Source::Bin => blob
                    .ok_or_else(|| {
                        content(
                            file,
                            &*place,
                            "is in the GLB file, which has no binary data",
                        )
                    })?
                    .into(),
                Source::Uri(uri) if uri.starts_with("data:") => uri
                    .split_once(";base64,")
                    .and_then(|(_, text)| BASE64.decode(text).ok())
                    .ok_or_else(|| {
                        content(
                            file,
                            &*place,
                            "is not base64; expected a data URI in base64",
                        )
                    })?
                    .into(),
                Source::Uri(uri) => {
                    let name = unescaped(uri);
                    let outside = name.contains("://") || name.starts_with(['/', '\\']);
                    if outside || name.split(['/', '\\']).any(|part| part == "..") {
                        let problem = format!("is at '{name}'; expected a file beside this one");
                        return Err(content(file, place, problem));
                    }
                    beside(&name)
                        .map_err(|source| MeshError::Unreadable {
                            file: format!("{name} (a buffer of {file})"),
                            source,
                        })?
                        .into()
                }
            };
            if bytes.len() < buffer.length() {
                let (there, expected) = (bytes.len(), buffer.length());
                let problem = format!("has {there} bytes; expected {expected}");
                return Err(content(file, place, problem));
            }
            buffers.push(bytes);
        }
        Ok(Self { buffers })
    }

    /// Total size of all buffers in bytes.
    pub fn bytes(&self) -> usize {
        self.buffers.iter().map(|bytes| bytes.len()).sum()
    }

    /// Vertex positions: floats, or whole numbers of 8 or 16 bits (`KHR_mesh_quantization`).
    pub fn positions(&self, accessor: &Accessor) -> Result<Vec<DVec3>, String> {
        if accessor.dimensions() != Dimensions::Vec3 {
            return Err("has positions that are not three numbers each".into());
        }
        // Bytes of a number, the number, and the one that stands for 1 if they are normalized.
        type Number = (usize, fn(&[u8]) -> f64, f64);
        let (width, number, most): Number = match accessor.data_type() {
            DataType::F32 => (
                4,
                |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
                1.0,
            ),
            DataType::I8 => (1, |b| i8::from_le_bytes([b[0]]).into(), 127.0),
            DataType::U8 => (1, |b| b[0].into(), 255.0),
            DataType::I16 => (2, |b| i16::from_le_bytes([b[0], b[1]]).into(), 32767.0),
            DataType::U16 => (2, |b| u16::from_le_bytes([b[0], b[1]]).into(), 65535.0),
            DataType::U32 => {
                return Err("has positions of 32-bit whole numbers; expected floats".into());
            }
        };
        // glTF 2.0, section 3.11: the lowest whole number stands for −1, too.
        let is_fraction = accessor.normalized() && accessor.data_type() != DataType::F32;
        let scaled = |x: DVec3| match is_fraction {
            true => (x / most).max(DVec3::NEG_ONE),
            false => x,
        };
        let items = self.items(accessor, 3 * width)?;
        let part = |item: &[u8], axis: usize| number(&item[axis * width..]);
        Ok(items
            .map(|item| scaled(DVec3::new(part(item, 0), part(item, 1), part(item, 2))))
            .collect())
    }

    /// Vertex indices.
    pub fn indices(&self, accessor: &Accessor) -> Result<Vec<u32>, String> {
        if accessor.dimensions() != Dimensions::Scalar {
            return Err("has indices that are not one number each".into());
        }
        match accessor.data_type() {
            DataType::U8 => Ok(self.items(accessor, 1)?.map(|b| b[0].into()).collect()),
            DataType::U16 => {
                let items = self.items(accessor, 2)?;
                Ok(items
                    .map(|b| u16::from_le_bytes([b[0], b[1]]).into())
                    .collect())
            }
            DataType::U32 => {
                let items = self.items(accessor, 4)?;
                Ok(items
                    .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                    .collect())
            }
            _ => Err("has indices that are not unsigned whole numbers".into()),
        }
    }

    /// Items of an accessor, of this number of bytes each.
    fn items(
        &self,
        accessor: &Accessor,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, String> {
        let place = format!("accessor {}", accessor.index());
        if accessor.sparse().is_some() {
            return Err(format!(
                "{place} is sparse, which is not read; export it dense"
            ));
        }
        let view = accessor
            .view()
            .ok_or_else(|| format!("{place} has no data"))?;
        let (count, stride) = (accessor.count(), view.stride().unwrap_or(size));
        let range = (|| {
            let end = view.offset().checked_add(view.length())?;
            let bytes = self
                .buffers
                .get(view.buffer().index())?
                .get(view.offset()..end)?;
            let needed = match count {
                0 => 0,
                count => stride.checked_mul(count - 1)?.checked_add(size)?,
            };
            bytes
                .get(accessor.offset()..)?
                .get(..needed)
                .filter(|_| stride >= size)
        })();
        let bytes = range.ok_or_else(|| {
            format!("{place} says {count} items of {size} bytes, which are not in its buffer")
        })?;
        Ok((0..count).filter_map(move |item| {
            let start = item * stride;
            bytes.get(start..start + size)
        }))
    }
}

/// A URI's path with its escapes (`%20`) replaced.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let code = (*first == b'%')
            .then(|| after.get(..2))
            .flatten()
            .and_then(|hex| std::str::from_utf8(hex).ok())
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
