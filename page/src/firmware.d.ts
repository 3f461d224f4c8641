// The firmware's HEX file, which build.mjs puts in.
declare module "weeder.hex" {
    const hex: string;
    export default hex;
}
