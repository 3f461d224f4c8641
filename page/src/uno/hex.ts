// Intel HEX, the file format of firmware: converts text into the bytes of a flash.
//
// It supports data records and the two kinds of base address that tools write. Start addresses are for other chips.

/** An error in a HEX file, and what would be right. */
export class HexError extends Error {}

const DATA = 0;
const END = 1;
const SEGMENT_BASE = 2;
const SEGMENT_START = 3;
const LINEAR_BASE = 4;
const LINEAR_START = 5;

/** Bytes of a record that are not data: count, address (2), kind and checksum. */
const FRAME_BYTES = 5;

/** Reads a HEX file into a flash of `size` bytes. Other bytes are erased (0xff). */
export function readHex(text: string, size: number): Uint8Array {
    const flash = new Uint8Array(size).fill(0xff);
    let base = 0;
    let filled = false;
    for (const [index, line] of text.split(/\r?\n/).entries()) {
        if (line.trim() === "") continue;
        const refuse = (reason: string) => new HexError(`line ${index + 1} of the HEX file ${reason}`);
        const digits = line.trim().match(/^:((?:[0-9a-f]{2})+)$/i)?.[1];
        if (digits === undefined) throw refuse("is not a colon with pairs of hexadecimal digits: is it a HEX file?");
        const record = Uint8Array.from(digits.match(/../g) ?? [], (pair) => Number.parseInt(pair, 16));
        const [count = 0, high = 0, low = 0, kind = 0] = record;
        if (record.length !== count + FRAME_BYTES) throw refuse("is cut off: load the file again");
        if (record.reduce((sum, byte) => sum + byte, 0) % 256 !== 0)
            throw refuse("has a wrong checksum: load it again");
        const data = record.subarray(4, 4 + count);
        const number = () => data.reduce((sum, byte) => sum * 256 + byte, 0);
        switch (kind) {
            case DATA: {
                const address = base + high * 256 + low;
                if (address + count > size)
                    throw refuse(`reaches beyond the ${size} bytes of flash: it is not for this chip`);
                flash.set(data, address);
                filled = true;
                break;
            }
            case END:
                if (!filled) throw new HexError("the HEX file is empty: build the firmware again");
                return flash;
            case SEGMENT_BASE:
                base = number() * 16;
                break;
            case LINEAR_BASE:
                base = number() * 65536;
                break;
            case SEGMENT_START:
            case LINEAR_START:
                break;
            default:
                throw refuse(`has the unknown kind ${kind}`);
        }
    }
    throw new HexError("the HEX file has no end: load it again");
}

/** The size of a firmware in a flash: all later bytes are erased. */
export function usedBytes(flash: Uint8Array): number {
    return flash.findLastIndex((byte) => byte !== 0xff) + 1;
}
