//! A capture from a camera: finding it, fetching every plane, checking, and writing what a person wants.

mod convert;
mod deliver;
mod device;
mod receive;
mod scene_source;
mod words;

pub(crate) use deliver::{Delivery, DeliveryArgs, deliver};
pub(crate) use device::{DeviceArgs, Opened};
pub(crate) use receive::{Received, receive};
pub(crate) use words::link_failure;
