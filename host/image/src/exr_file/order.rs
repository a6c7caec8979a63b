//! Attributes in the order of their names.
//!
//! The `exr` crate keeps custom attributes in a hash map with a random seed, so that two runs write them in different
//! orders. Sorting the written header makes files a function of their content; its length stays the same, so every
//! offset in the file stays right. The OpenEXR library sorts by name as well.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Error, ErrorKind, Read, Seek, SeekFrom, Write};

/// Bytes before the first attribute: magic number and version.
const PREAMBLE: u64 = 8;

/// Sorts the attributes of a file of one part that is complete in `out`, which is left at the file's end.
pub(super) fn sort_attributes(out: &mut BufWriter<&File>) -> std::io::Result<()> {
    out.flush()?;
    let mut file: &File = out.get_ref();
    file.seek(SeekFrom::Start(PREAMBLE))?;
    let mut attributes = read_attributes(&mut BufReader::new(file))?;
    attributes.sort();
    file.seek(SeekFrom::Start(PREAMBLE))?;
    file.write_all(&attributes.concat())?;
    file.seek(SeekFrom::End(0)).map(|_| ())
}

/// The attributes up to the null byte that ends a header: name, null, type, null, size (i32), `size` bytes.
fn read_attributes(reader: &mut impl BufRead) -> std::io::Result<Vec<Vec<u8>>> {
    let mut attributes = Vec::new();
    loop {
        let mut record = Vec::new();
        reader.read_until(0, &mut record)?;
        if record == [0] {
            return Ok(attributes);
        }
        reader.read_until(0, &mut record)?;
        let mut size = [0; 4];
        reader.read_exact(&mut size)?;
        record.extend(size);
        let size = u64::try_from(i32::from_le_bytes(size)).map_err(|e| Error::new(ErrorKind::InvalidData, e))?;
        let expected = record.len() as u64 + size;
        reader.take(size).read_to_end(&mut record)?;
        if record.len() as u64 != expected {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        attributes.push(record);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_order_changes() {
        let record = |name: &str, value: &[u8]| {
            let size = u8::try_from(value.len()).unwrap();
            [name.as_bytes(), b"\0string\0", &[size, 0, 0, 0], value].concat()
        };
        let (a, b, c) = (record("a", b"three\0"), record("b", b""), record("brewster:x", b"\0\0"));
        let around = |middle: &[&[u8]]| [&b"magic123"[..], &middle.concat(), b"\0pixels"].concat();
        let file = tempfile::tempfile().unwrap();
        let mut out = BufWriter::new(&file);
        out.write_all(&around(&[&c, &a, &b])).unwrap();
        sort_attributes(&mut out).unwrap();
        out.write_all(b" more").unwrap();
        out.flush().unwrap();
        drop(out);
        let mut found = Vec::new();
        (&file).rewind().unwrap();
        (&file).read_to_end(&mut found).unwrap();
        assert_eq!(found, [around(&[&a, &b, &c]).as_slice(), b" more"].concat());
    }

    #[test]
    fn a_header_that_ends_early_is_an_error() {
        let whole = b"name\0string\0\x03\0\0\0abc\0";
        assert_eq!(read_attributes(&mut &whole[..]).unwrap().len(), 1);
        for cut in 0..whole.len() {
            assert!(read_attributes(&mut &whole[..cut]).is_err(), "cut at {cut}");
        }
        assert!(read_attributes(&mut &b"name\0string\0\xff\xff\xff\xff"[..]).is_err());
    }
}
