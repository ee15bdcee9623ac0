//! Haptic devices on this machine's USB, as Linux lists them.

use std::fs;
use std::path::Path;

/// Where Linux lists USB devices.
pub const LINUX: &str = "/sys/bus/usb/devices";
/// Vendor and product, what it is. Seen in the vendor's own rules and in users' reports.
const KNOWN: [(&str, &str, &str); 3] = [
    ("0301", "2988", "3D Systems Touch, serial: /dev/ttyACM*"),
    ("2988", "0302", "3D Systems Touch"),
    ("2988", "0304", "3D Systems Touch, HID: /dev/hidraw*"),
];

/// A device of a known kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsbDevice {
    /// Vendor and product, as `lsusb` has them.
    pub id: String,
    /// What it is.
    pub kind: &'static str,
    /// What it calls itself; empty if nothing.
    pub product: String,
}

/// Haptic devices in a folder as [`LINUX`], by id.
///
/// # Errors
/// The folder cannot be read: another system, or a container.
pub fn devices(folder: &Path) -> std::io::Result<Vec<UsbDevice>> {
    let mut found = vec![];
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        // Entries without an id are interfaces.
        let word = |name: &str| fs::read_to_string(path.join(name)).map(|text| text.trim().to_lowercase());
        let (Ok(vendor), Ok(product)) = (word("idVendor"), word("idProduct")) else { continue };
        let kind = KNOWN.iter().find(|(v, p, _)| *v == vendor && *p == product);
        if let Some((_, _, kind)) = kind {
            let name = fs::read_to_string(path.join("product")).unwrap_or_default();
            found.push(UsbDevice { id: format!("{vendor}:{product}"), kind, product: name.trim().into() });
        }
    }
    found.sort_by(|a, b| a.id.cmp(&b.id));
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_devices_are_found_among_others() {
        let folder = tempfile::tempdir().unwrap();
        let add = |name: &str, files: &[(&str, &str)]| {
            fs::create_dir(folder.path().join(name)).unwrap();
            files.iter().for_each(|(file, text)| fs::write(folder.path().join(name).join(file), text).unwrap());
        };
        add("1-1", &[("idVendor", "1d6b\n"), ("idProduct", "0002\n")]);
        add("1-2", &[("idVendor", "2988\n"), ("idProduct", "0304\n"), ("product", "Touch\n")]);
        add("1-3", &[("idVendor", "0301\n"), ("idProduct", "2988\n")]);
        add("1-2:1.0", &[("bInterfaceClass", "03\n")]);
        let found = devices(folder.path()).unwrap();
        let told: Vec<_> = found.iter().map(|d| (d.id.as_str(), d.product.as_str())).collect();
        assert_eq!(told, [("0301:2988", ""), ("2988:0304", "Touch")]);
        assert!(devices(&folder.path().join("none")).is_err());
    }
}
