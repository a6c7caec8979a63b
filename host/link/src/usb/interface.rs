//! Which interface and endpoints of a device are the camera's, from its descriptors alone.

use crate::LinkError;

/// bInterfaceClass: vendor-specific.
pub const CLASS: u8 = 0xFF;
/// bInterfaceSubClass of the camera ("B").
pub const SUBCLASS: u8 = 0x42;
/// bInterfaceProtocol of the camera ("W").
pub const PROTOCOL: u8 = 0x57;

/// One alternate setting of an interface, as its descriptor has it.
#[derive(Clone, Debug)]
pub(super) struct Setting {
    pub(super) interface: u8,
    pub(super) alternate: u8,
    /// Class, subclass, protocol.
    pub(super) triple: (u8, u8, u8),
    pub(super) endpoints: Vec<Endpoint>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Endpoint {
    /// bEndpointAddress: bit 7 set is towards the host.
    pub(super) address: u8,
    pub(super) bulk: bool,
    pub(super) max_packet: u16,
}

/// What has to be claimed and used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pipes {
    pub(super) interface: u8,
    pub(super) from_camera: u8,
    pub(super) to_camera: u8,
    /// A transfer to the camera that fills its last packet of this many bytes needs an empty one behind it.
    pub(super) packet_bytes: usize,
}

/// The camera's pipes, or `None` where the device is no camera.
///
/// # Errors
/// [`LinkError::NoEndpoints`] where it says it is one and lacks a bulk endpoint.
pub(super) fn choose(settings: &[Setting]) -> Option<Result<Pipes, LinkError>> {
    // Alternate setting 0 is in force without asking.
    let camera = settings.iter().find(|s| s.triple == (CLASS, SUBCLASS, PROTOCOL) && s.alternate == 0)?;
    let bulk = |towards_host: bool| {
        camera.endpoints.iter().find(|e| e.bulk && e.max_packet > 0 && (e.address & 0x80 != 0) == towards_host)
    };
    let (Some(from), Some(to)) = (bulk(true), bulk(false)) else { return Some(Err(LinkError::NoEndpoints)) };
    Some(Ok(Pipes {
        interface: camera.interface,
        from_camera: from.address,
        to_camera: to.address,
        packet_bytes: usize::from(to.max_packet),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn endpoint(address: u8, bulk: bool) -> Endpoint {
        Endpoint { address, bulk, max_packet: if address & 0x80 == 0 { 512 } else { 64 } }
    }

    fn camera(interface: u8, endpoints: &[Endpoint]) -> Setting {
        Setting { interface, alternate: 0, triple: (0xFF, 0x42, 0x57), endpoints: endpoints.to_vec() }
    }

    #[test]
    fn the_camera_is_found_behind_other_interfaces_and_endpoints() {
        let keyboard = Setting {
            interface: 0,
            alternate: 0,
            triple: (3, 1, 1),
            endpoints: vec![endpoint(0x81, true), endpoint(1, true)],
        };
        let endpoints = [endpoint(0x83, false), endpoint(0x84, true), endpoint(0x05, true), endpoint(0x86, true)];
        let pipes = choose(&[keyboard.clone(), camera(2, &endpoints)]).unwrap().unwrap();
        assert_eq!(pipes, Pipes { interface: 2, from_camera: 0x84, to_camera: 0x05, packet_bytes: 512 });
        assert!(choose(&[keyboard]).is_none());
        assert!(choose(&[]).is_none());
    }

    #[test]
    fn a_vendor_interface_of_somebody_else_is_no_camera() {
        for triple in [(0xFF, 0x42, 0x58), (0xFF, 0, 0x57), (0xFE, 0x42, 0x57)] {
            let other = Setting { triple, ..camera(0, &[endpoint(0x81, true), endpoint(1, true)]) };
            assert!(choose(&[other]).is_none());
        }
        let alternate = Setting { alternate: 1, ..camera(0, &[endpoint(0x81, true), endpoint(1, true)]) };
        assert!(choose(&[alternate]).is_none());
    }

    #[test]
    fn a_camera_without_both_bulk_endpoints_is_an_error() {
        let empty = Endpoint { max_packet: 0, ..endpoint(1, true) };
        for endpoints in
            [vec![], vec![endpoint(0x81, true)], vec![endpoint(1, true)], vec![endpoint(0x81, true), empty]]
        {
            assert!(matches!(choose(&[camera(0, &endpoints)]), Some(Err(LinkError::NoEndpoints))));
        }
        let interrupt_in = [endpoint(0x81, false), endpoint(1, true)];
        assert!(matches!(choose(&[camera(0, &interrupt_in)]), Some(Err(LinkError::NoEndpoints))));
    }
}
