// Intel HEX, the file format of firmware, as `weeder hex` writes it: data records below 64 KiB and an end.

/** Reads such a file into a flash of `size` bytes. Other bytes are erased (0xff). */
export function readHex(text: string, size: number): Uint8Array {
    const flash = new Uint8Array(size).fill(0xff);
    // A colon, the count, the address, the kind, the data and the checksum.
    for (const [, address = "", data = ""] of text.matchAll(/^:..(....)00(.*)..$/gm)) {
        const bytes = Uint8Array.from(data.match(/../g) ?? [], (byte) => Number.parseInt(byte, 16));
        flash.set(bytes, Number.parseInt(address, 16));
    }
    return flash;
}

/** The size of a firmware in a flash: all later bytes are erased. */
export function usedBytes(flash: Uint8Array): number {
    return flash.findLastIndex((byte) => byte !== 0xff) + 1;
}
