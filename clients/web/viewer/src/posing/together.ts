// SPDX-License-Identifier: Apache-2.0
// Who is in the session and who poses: asked for, taken, given.
import { Feature, Role, type Client, type Members } from "../../../protocol/src/index.js";
import { Store } from "../state/store.js";
import { askServer } from "./ask_server.js";

export interface Person {
  readonly connection: bigint;
  readonly name: string;
  readonly self: boolean;
  readonly controls: boolean;
  readonly asks: boolean;
  /** Control can be given to them. */
  readonly takes: boolean;
}

export interface TogetherState {
  readonly connected: boolean;
  /** The server tells who is there; older ones do not. */
  readonly presence: boolean;
  readonly controls: boolean;
  /** Control is free. */
  readonly vacant: boolean;
  /** Kept for its last holder so long. */
  readonly reservedSeconds: number;
  readonly asking: boolean;
  readonly people: readonly Person[];
  /** More than are named. */
  readonly others: number;
}

const NAME_KEY = "ecorche.name";

export const ownName = (): string => localStorage.getItem(NAME_KEY) ?? "";
export const setOwnName = (name: string): void => localStorage.setItem(NAME_KEY, name.trim().slice(0, 64));

export class Together {
  readonly store = new Store<TogetherState>({
    connected: false, presence: false, controls: false, vacant: false, reservedSeconds: 0, asking: false, people: [], others: 0,
  });
  #client: Client | null = null;

  constructor(private readonly say: (text: string) => void) {}

  /** The client once; what it tells comes by itself from then on. */
  follow(client: Client): void {
    this.#client = client;
    const control = () => {
      const { role, vacant, reservedSeconds } = client.control;
      const controls = role === Role.CONTROLLER;
      const { controls: before, asking, connected } = this.store.state;
      this.store.set({ connected: true, presence: client.hello.features.includes(Feature.PRESENCE), controls, vacant, reservedSeconds, asking: asking && !controls });
      if (connected && controls && !before) this.say("You pose this body now");
      if (connected && !controls && before) this.say("You look on now");
    };
    client.on("control", control);
    client.on("members", (members) => this.#members(client, members));
    control();
  }

  get holder(): Person | undefined {
    return this.store.state.people.find((person) => person.controls);
  }

  /** Takes it where it is free, and else asks for it. */
  take(): Promise<void> {
    return this.#do(async (client) => {
      if (!this.store.state.presence || this.store.state.vacant) return client.claimControl();
      if (!(await client.askControl())) this.store.set({ asking: true });
    });
  }

  withdraw(): Promise<void> {
    return this.#do(async (client) => {
      await client.withdrawAsk();
      this.store.set({ asking: false });
    });
  }

  give(person: Person): Promise<void> {
    return this.#do((client) => client.giveControl(person.connection));
  }

  /** For whoever takes it next. */
  release(): Promise<void> {
    return this.#do((client) => client.releaseControl());
  }

  #members(client: Client, { members, others }: Members): void {
    const people = members.map((member): Person => ({
      connection: member.connection, name: member.name, self: member.connection === client.hello.connection,
      controls: member.role === Role.CONTROLLER, asks: member.asksControl, takes: member.takesControl,
    }));
    const before = this.store.state.people;
    this.store.set({ people, others, asking: people.some((person) => person.self && person.asks) });
    for (const person of people) {
      if (this.store.state.controls && person.asks && !before.some((old) => old.connection === person.connection && old.asks)) this.say(`${person.name} asks to pose`);
    }
  }

  #do(run: (client: Client) => Promise<void>): Promise<void> {
    return askServer(this.#client, this.say, run);
  }
}
