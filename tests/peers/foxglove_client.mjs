// A client made of @foxglove/ws-protocol: subscribes to all channels, reads and sets the mass; prints what it found.
// Arguments: address, subprotocol, mass to set.
import foxglove from '@foxglove/ws-protocol';
import WebSocket from 'ws';

const { FoxgloveClient } = foxglove;
const [, , address, protocol, mass] = process.argv;
const found = { messages: {}, samples: {}, parameters: [], status: [] };
const socket = new WebSocket(address, [protocol]);
// The package knows the protocol by its first name only: it is told that one, and what was agreed on is printed.
let agreed = '';
socket.addEventListener('open', () => {
  agreed = socket.protocol;
  Object.defineProperty(socket, 'protocol', { value: 'foxglove.websocket.v1' });
});
const client = new FoxgloveClient({ ws: socket });
const topics = new Map();
client.on('error', (error) => { console.error(error); process.exit(1); });
client.on('serverInfo', (info) => { found.info = info; });
client.on('status', (status) => found.status.push(status.message));
client.on('advertise', (channels) => {
  for (const channel of channels) {
    JSON.parse(channel.schema);
    topics.set(client.subscribe(channel.id), channel.topic);
  }
  client.subscribeParameterUpdates(['mass']);
  client.getParameters(['mass', 'damping', 'spring'], 'first');
});
client.on('message', ({ subscriptionId, data }) => {
  const topic = topics.get(subscriptionId);
  found.messages[topic] = (found.messages[topic] ?? 0) + 1;
  found.samples[topic] = JSON.parse(new TextDecoder().decode(data));
});
client.on('parameterValues', ({ parameters, id }) => {
  found.parameters.push({ id, parameters });
  if (id === 'first') client.setParameters([{ name: 'mass', value: Number(mass) }], 'set');
});
setTimeout(() => {
  found.protocol = agreed;
  console.log(JSON.stringify(found));
  process.exit(0);
}, 3000);
