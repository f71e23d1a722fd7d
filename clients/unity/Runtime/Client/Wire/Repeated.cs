// SPDX-License-Identifier: Apache-2.0
using System;

namespace Ecorche.Wire
{
    /// <summary>A repeated field. Cleared, it keeps its items for the next message, so that none is allocated again.</summary>
    public sealed class Repeated<T>
    {
        private T[] _items = System.Array.Empty<T>();

        public int Count { get; private set; }

        public T this[int row]
        {
            get => row < Count ? _items[row] : throw new ArgumentOutOfRangeException(nameof(row));
            set
            {
                if (row >= Count) throw new ArgumentOutOfRangeException(nameof(row));
                _items[row] = value;
            }
        }

        public ReadOnlySpan<T> Span => _items.AsSpan(0, Count);

        public void Clear() => Count = 0;

        public void Append(T item)
        {
            Grow();
            _items[Count++] = item;
        }

        /// <summary>What stood last where the next item comes.</summary>
        internal T Spare => Count < _items.Length ? _items[Count] : default;

        private void Grow()
        {
            if (Count == _items.Length) System.Array.Resize(ref _items, Math.Max(4, 2 * Count));
        }
    }

    public static class RepeatedMessages
    {
        /// <summary>One more message, whatever stood there before: fill it, or clear it first.</summary>
        public static T Add<T>(this Repeated<T> to) where T : class, new()
        {
            T item = to.Spare ?? new T();
            to.Append(item);
            return item;
        }
    }
}
