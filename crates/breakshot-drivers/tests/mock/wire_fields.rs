//! Changes of the fields of an encoded protobuf message.

#![allow(dead_code, unreachable_pub, reason = "each test uses a subset")]

/// A field: its key (number and wire type) and its value's bytes, without the length of a sequence.
struct Field {
    key: u64,
    value: Vec<u8>,
}

const SEQUENCE: u64 = 2;
/// Largest number of a field that is added where it is absent.
const LAST_FIELD: u64 = 22;

/// All changes of one field of a message: removed, other values, and set where it was absent.
pub fn changes(message: &[u8]) -> Vec<Vec<u8>> {
    let fields = &fields(message);
    let mut changes = Vec::new();
    // Of a long list the first, the middle and the last.
    let of_key = |key: u64| (0..fields.len()).filter(move |&k| fields[k].key == key).collect::<Vec<_>>();
    let keys: std::collections::BTreeSet<u64> = fields.iter().map(|field| field.key).collect();
    let some = |all: Vec<usize>| -> std::collections::BTreeSet<usize> {
        [0, all.len() / 2, all.len() - 1].into_iter().map(|k| all[k]).collect()
    };
    for k in keys.into_iter().flat_map(|key| some(of_key(key))) {
        let with = |value: Option<Vec<u8>>| -> Vec<u8> {
            let each = fields.iter().enumerate().filter(|(other, _)| *other != k || value.is_some());
            each.flat_map(|(other, field)| {
                let value = value.as_ref().filter(|_| other == k).unwrap_or(&field.value);
                encoded(field.key, value)
            })
            .collect()
        };
        changes.push(with(None));
        changes.extend(values(&fields[k]).into_iter().map(|value| with(Some(value))));
    }
    let absent = (1..=LAST_FIELD).filter(|number| fields.iter().all(|field| field.key >> 3 != *number));
    changes.extend(absent.map(|number| {
        let mut bytes = message.to_vec();
        bytes.extend(encoded(number << 3, &[1]));
        bytes
    }));
    changes
}

/// Other values of a field.
fn values(field: &Field) -> Vec<Vec<u8>> {
    let value = &field.value;
    match field.key & 7 {
        0 => {
            let number = varint(value, &mut 0).unwrap_or(0);
            [0, 2, 9, number.wrapping_add(1), u64::MAX]
                .into_iter()
                .filter(|other| *other != number)
                .map(as_varint)
                .collect()
        }
        SEQUENCE => {
            let mut others = vec![Vec::new(), value[..value.len() - value.len().min(4)].to_vec()];
            others.push([&value[..], &value[..value.len().min(4)]].concat());
            // Lists of numbers have four or eight bytes each.
            for at in [0, value.len().saturating_sub(4)] {
                if let Some(bytes) = value.get(at..at + 4) {
                    let number = f32::from_le_bytes(bytes.try_into().expect("four bytes"));
                    for other in [f32::NAN, f32::INFINITY, -number, number + 20.0] {
                        let mut changed = value.clone();
                        changed[at..at + 4].copy_from_slice(&other.to_le_bytes());
                        others.push(changed);
                    }
                }
            }
            others
        }
        _ => vec![vec![0; value.len()], vec![0xff; value.len()], vec![0x40; value.len()]],
    }
}

fn fields(message: &[u8]) -> Vec<Field> {
    let (mut at, mut fields) = (0, Vec::new());
    while let Some(key) = varint(message, &mut at) {
        let begin = at;
        let length = match key & 7 {
            0 => {
                varint(message, &mut at);
                at - begin
            }
            1 => 8,
            SEQUENCE => varint(message, &mut at).unwrap_or(0) as usize,
            _ => 4,
        };
        if key & 7 != 0 {
            at += length;
        }
        let value = message[at - length..at].to_vec();
        fields.push(Field { key, value });
    }
    fields
}

fn encoded(key: u64, value: &[u8]) -> Vec<u8> {
    let mut bytes = as_varint(key);
    if key & 7 == SEQUENCE {
        bytes.extend(as_varint(value.len() as u64));
    }
    bytes.extend(value);
    bytes
}

fn varint(bytes: &[u8], at: &mut usize) -> Option<u64> {
    let mut number = 0;
    for shift in 0..10 {
        let byte = *bytes.get(*at)?;
        *at += 1;
        number |= u64::from(byte & 0x7f) << (7 * shift);
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

fn as_varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}
