// Decompresses the parts that build.mjs has compressed. The page is smaller this way: the Base64 of compressed data is
// shorter than the data.

export async function unpack(packed: Uint8Array<ArrayBuffer>): Promise<ArrayBuffer> {
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return await new Response(stream).arrayBuffer();
}
