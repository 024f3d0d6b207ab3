//! Tensors of a file that a person brings: what torch.save wrote, in either of its formats, or safetensors.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use candle_core::pickle::{self, Object, Stack};
use candle_core::{DType, Device, Error, Result, Tensor};

/// What files begin with that torch.save wrote before version 1.6: a pickle of this number.
const OLD_MAGIC: [u8; 15] = [
    0x80, 2, 0x8a, 10, 0x6c, 0xfc, 0x9c, 0x46, 0xf9, 0x20, 0x6a, 0xa8, 0x50, 0x19, b'.',
];
/// What files of the newer format begin with, an archive.
const ARCHIVE_MAGIC: &[u8] = b"PK";
/// Pickles between that and the one with the tensors: the version and the machine. Behind it comes one with the order of the
/// storages.
const BEFORE: usize = 2;

/// All tensors of a file, by name.
pub(super) fn read(path: &Path) -> Result<HashMap<String, Tensor>> {
    let mut reader = BufReader::new(File::open(path)?);
    let start = reader.fill_buf()?;
    if start.starts_with(&OLD_MAGIC) {
        let size = reader.get_ref().metadata()?.len();
        old(&mut reader, size)
    } else if start.starts_with(ARCHIVE_MAGIC) {
        Ok(pickle::read_all(path)?.into_iter().collect())
    } else {
        candle_core::safetensors::load(path, &Device::Cpu)
    }
}

/// Tensors of the older format, from a file of `size` bytes: pickles, then the numbers of each storage behind their count.
fn old(reader: &mut impl BufRead, size: u64) -> Result<HashMap<String, Tensor>> {
    reader.consume(OLD_MAGIC.len());
    for _ in 0..BEFORE {
        unpickled(reader)?;
    }
    let Object::Dict(entries) = unpickled(reader)? else {
        return Err(Error::Msg("it holds no dictionary of tensors".to_owned()));
    };
    let mut infos = Vec::new();
    for (name, value) in entries {
        infos.extend(value.into_tensor_info(name, Path::new(""))?);
    }
    let Object::List(order) = unpickled(reader)? else {
        return Err(Error::Msg("it does not say where the tensors are".to_owned()));
    };
    // The storage of a tensor is the last part of its path.
    let storage = |path: &str| path.rsplit('/').next().map(str::to_owned);
    let types: BTreeMap<String, DType> = infos
        .iter()
        .filter_map(|info| Some((storage(&info.path)?, info.dtype)))
        .collect();
    let mut storages = BTreeMap::new();
    for key in order {
        let key = key.unicode()?;
        let Some(&dtype) = types.get(&key) else {
            return Err(Error::Msg(format!("no tensor is stored in {key}")));
        };
        let mut count = [0; 8];
        reader.read_exact(&mut count)?;
        let bytes = u64::from_le_bytes(count).saturating_mul(dtype.size_in_bytes() as u64);
        if bytes > size {
            return Err(Error::Msg("it is cut off".to_owned()));
        }
        let mut values = vec![0; bytes as usize];
        reader.read_exact(&mut values)?;
        storages.insert(key, values);
    }
    let mut tensors = HashMap::new();
    for info in infos {
        let values = storage(&info.path).and_then(|key| storages.get(&key));
        let start = info.layout.start_offset();
        let length = info.layout.shape().elem_count() * info.dtype.size_in_bytes();
        let values = values.and_then(|values| values.get(start..start.checked_add(length)?));
        // Tensors that share a storage in another order are of no network that is read here.
        if let Some(values) = values.filter(|_| info.layout.is_contiguous()) {
            let tensor = Tensor::from_raw_buffer(values, info.dtype, info.layout.dims(), &Device::Cpu)?;
            tensors.insert(info.name, tensor);
        }
    }
    Ok(tensors)
}

fn unpickled(reader: &mut impl BufRead) -> Result<Object> {
    let mut stack = Stack::empty();
    stack.read_loop(reader)?;
    stack.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As torch.save wrote it before version 1.6: `weight` of 2 x 3 numbers, and the whole number `count`.
    const OLD: &[u8] = include_bytes!("fixtures/old.pth");

    #[test]
    fn a_file_of_the_older_format_is_read_and_one_that_is_cut_off_or_spoilt_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("network.pth");
        std::fs::write(&path, OLD).unwrap();
        let tensors = read(&path).unwrap();
        let weight: Vec<Vec<f32>> = tensors["weight"].to_vec2().unwrap();
        assert_eq!(weight, [[0.5, 1.0, 1.5], [2.0, 2.5, 3.0]]);
        assert_eq!(tensors["count"].to_scalar::<i64>().unwrap(), 7);
        for length in 0..OLD.len() {
            std::fs::write(&path, &OLD[..length]).unwrap();
            assert!(read(&path).is_err(), "the first {length} bytes");
        }
    }
}
