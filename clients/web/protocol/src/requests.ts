// SPDX-License-Identifier: Apache-2.0
// Requests by their ids, until they are answered or the connection ends.
import { create, toBinary } from "@bufbuild/protobuf";
import { ConnectionError, ServerError } from "./errors.js";
import { EnvelopeSchema, type Envelope } from "./gen/ecorche/v1/envelope_pb.js";

export type Message = Envelope["message"];
export type Case = Exclude<Message["case"], undefined>;
export type ValueOf<C extends Case> = Extract<Message, { case: C }>["value"];

export interface Answer<C extends Case> {
  value: ValueOf<C>;
  payload: Uint8Array;
}

interface Waiting {
  expected: Case;
  resolve(answer: { value: unknown; payload: Uint8Array }): void;
  reject(error: Error): void;
}

/** 1 is that of the link's pings. */
const FIRST_ID = 2n;

export class Requests {
  private next = FIRST_ID;
  private readonly waiting = new Map<bigint, Waiting>();

  /** The bytes of a request, and its answer: `expected`, a ServerError, or a ConnectionError. */
  ask<C extends Case>(message: Message, expected: C): { envelope: Uint8Array; answer: Promise<Answer<C>> } {
    const requestId = this.next++;
    const envelope = encode(message, requestId);
    const answer = new Promise<Answer<C>>((resolve, reject) => {
      this.waiting.set(requestId, { expected, resolve: resolve as Waiting["resolve"], reject });
    });
    return { envelope, answer };
  }

  /** Whether a request waited for this. */
  answer({ requestId, message }: Envelope, payload: Uint8Array): boolean {
    const waiting = this.waiting.get(requestId);
    if (!waiting) return false;
    this.waiting.delete(requestId);
    if (message.case === "status" && (message.value.code !== 0 || waiting.expected !== "status")) waiting.reject(new ServerError(message.value));
    else if (message.case !== waiting.expected) waiting.reject(new ConnectionError(`the server answers with ${message.case}, not ${waiting.expected}`));
    else waiting.resolve({ value: message.value, payload });
    return true;
  }

  /** None will be answered any more. */
  fail(error: Error): void {
    for (const { reject } of this.waiting.values()) reject(error);
    this.waiting.clear();
  }
}

export const encode = (message: Message, requestId = 0n): Uint8Array =>
  toBinary(EnvelopeSchema, create(EnvelopeSchema, { requestId, message }));
