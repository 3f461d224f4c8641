//! firmware
#![no_std]
#![no_main]
#![feature(abi_avr_interrupt)]

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! { loop {} }

#[avr_device::entry]
fn main() -> ! {
    let dp = avr_device::atmega328p::Peripherals::take().unwrap();
    struct W(avr_device::atmega328p::USART0);
    impl ufmt::uWrite for W { type Error = (); fn write_str(&mut self, s: &str) -> Result<(), ()> { for b in s.bytes() { self.0.udr0().write(|w| w.set(b)); } Ok(()) } }
    let mut w = W(dp.USART0);
    loop { control::hello(&mut w, 3).ok(); }
}
