// What build.mjs has packed: the page is smaller so, as Base64 of what is packed is shorter than the thing itself.

export async function unpack(packed: Uint8Array<ArrayBuffer>): Promise<ArrayBuffer> {
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return await new Response(stream).arrayBuffer();
}
