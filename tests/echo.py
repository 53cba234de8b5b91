"""A machine with a serial line, for tests of what is at the other end."""

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.protocol import UARTReceiver, UARTTransmitter

__all__ = ["Echo"]


class Echo(wiring.Component):
    """Sends what it receives."""

    def __init__(self, *, period: int) -> None:
        self._period = period
        super().__init__({"rx": In(1), "tx": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.receiver = receiver = UARTReceiver(period=self._period)
        m.submodules.transmitter = transmitter = UARTTransmitter(period=self._period)
        m.d.comb += [
            receiver.rx.eq(self.rx),
            self.tx.eq(transmitter.tx),
            transmitter.bytes.valid.eq(receiver.bytes.valid),
            transmitter.bytes.payload.eq(receiver.bytes.p.byte),
            receiver.bytes.ready.eq(transmitter.bytes.ready),
        ]
        return m
