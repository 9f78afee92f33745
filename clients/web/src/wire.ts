// One message of the socket: u32 header_len | Envelope | payload, little-endian.

import { type MessageInitShape, create, fromBinary, toBinary } from "@bufbuild/protobuf";
import { type Envelope, EnvelopeSchema } from "../gen/bounced_pb";

export type Body = Envelope["body"];
export type BodyCase = NonNullable<Body["case"]>;
export type BodyOf<C extends BodyCase> = Extract<Body, { case: C }>["value"];
export type BodyInit = NonNullable<MessageInitShape<typeof EnvelopeSchema>["body"]>;

export interface Message {
  readonly envelope: Envelope;
  readonly payload: Uint8Array<ArrayBuffer>;
}

export function encode(requestId: bigint, body: BodyInit): Uint8Array<ArrayBuffer> {
  const header = toBinary(EnvelopeSchema, create(EnvelopeSchema, { requestId, body }));
  const bytes = new Uint8Array(4 + header.length);
  new DataView(bytes.buffer).setUint32(0, header.length, true);
  bytes.set(header, 4);
  return bytes;
}

export function decode(buffer: ArrayBuffer): Message {
  if (buffer.byteLength < 4) throw new Error("a message shorter than its length");
  const headerBytes = new DataView(buffer).getUint32(0, true);
  if (headerBytes > buffer.byteLength - 4) throw new Error("a header longer than its message");
  return {
    envelope: fromBinary(EnvelopeSchema, new Uint8Array(buffer, 4, headerBytes)),
    payload: new Uint8Array(buffer, 4 + headerBytes),
  };
}
