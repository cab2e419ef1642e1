// SPDX-License-Identifier: GPL-3.0-or-later
// What Mission Planner's code needs of libraries, maps and windows, as far as a session without a screen uses it.

using System;
using System.Collections.Generic;
using System.Linq;
using System.Text.RegularExpressions;
using System.Threading;
using MissionPlanner.Utilities;

namespace log4net {
    public interface ILog { void Info(object text); void Debug(object text); void Debug(object text, Exception error); void Warn(object text); void Fatal(object text);
        void Error(object text); void Error(object text, Exception error);
        void InfoFormat(string text, params object[] values); void DebugFormat(string text, params object[] values);
        void WarnFormat(string text, params object[] values); void ErrorFormat(string text, params object[] values); }

    public class Log : ILog {
        public void Info(object text) {} public void Debug(object text) {} public void Debug(object text, Exception error) {} public void Warn(object text) {}
        public void Fatal(object text) => Error(text);
        public void Error(object text) => MissionPlanner.Screen.Tell("log", $"{text}");
        public void Error(object text, Exception error) => Error($"{text} {error}");
        public void InfoFormat(string text, params object[] values) {} public void DebugFormat(string text, params object[] values) {}
        public void WarnFormat(string text, params object[] values) {} public void ErrorFormat(string text, params object[] values) {}
    }

    public static class LogManager { public static ILog GetLogger(Type type) => new Log(); }
}

namespace Newtonsoft.Json {
    public class JsonIgnoreAttribute : Attribute {}
    public class JsonConstructorAttribute : Attribute {}
    public enum Formatting { None, Indented }
    public static class JsonConvert {
        public static string SerializeObject(object value, params object[] options) => "";
        public static T DeserializeObject<T>(string text, params object[] options) => default(T);
    }
}

namespace GeoAPI.DataStructures { class Empty {} }
namespace Core.Geometry { class Empty {} }


namespace MissionPlanner.Comms { public class SerialPort {} public class MAVLinkSerialPort { public bool IsOpen; } }

namespace MissionPlanner.Mavlink {
    public static class MAVAuthKeys {
        public class AuthKey { public string Name; public byte[] Key; }
        public static readonly Dictionary<string, AuthKey> Keys = new Dictionary<string, AuthKey>();
    }
}

namespace MissionPlanner.Utilities {
    public class TerrainFollow {
        public TerrainFollow(MAVLinkInterface link) {}
        public void UnSub() {}
        public void checkTerrain(double lat, double lng) {}
    }

    public class adsb {
        public class PointLatLngAltHdg {
            public PointLatLngAltHdg(double lat, double lng, double alt, float heading, double speed, string id, DateTime at) {}
            public string CallSign; public ushort Squawk; public object Raw; public double VerticalSpeed;
            public MAVLink.MAV_COLLISION_THREAT_LEVEL ThreatLevel;
        }
    }

    public static class srtm {
        public enum tiletype { valid, invalid, ocean }
        public class altresponce { public double alt = 400; public tiletype currenttype = tiletype.valid; }
        public static altresponce getAltitude(double lat, double lng, double zoom = 16) => new altresponce();
    }

    public class DisplayView {}
    public static class DisplayViewExtensions {
        public static bool TryParse(string text, out DisplayView view) { view = new DisplayView(); return true; }
    }

    public class MissionFile {
        public class Item { public ushort command, doJumpId; public byte frame; public List<double?> @params; }
    }

    static class L10NU { public static string GetString(string key, string defaultTo = null) => defaultTo ?? key; }
    static class Json { public static string ToJSON(this object value, Newtonsoft.Json.Formatting format = 0) => ""; }
    static class Tracking { public static void AddException(Exception error) {} }

    /// The names of the flight modes, from Mission Planner's own ParameterMetaDataBackup.xml.
    public static class ParameterMetaDataRepository {
        static readonly System.Xml.Linq.XElement table =
            System.Xml.Linq.XDocument.Load(Environment.GetEnvironmentVariable("PARAMETER_META_DATA")).Root;

        public static List<KeyValuePair<int, string>> GetParameterOptionsInt(string name, string vehicle) =>
            table.Element(vehicle).Element(name).Element("Values").Value.Split(',').Select(each => each.Split(':'))
                .Select(pair => new KeyValuePair<int, string>(int.Parse(pair[0]), pair[1].Trim())).ToList();
        public static string GetParameterMetaData(string name, string key, string vehicle) => "";
    }
}

class Subscription {
    public MAVLink.MAVLINK_MSG_ID msgId; public Func<MAVLink.MAVLinkMessage, bool> function; public byte sysid, compid;
}

namespace MissionPlanner {
    public delegate void MethodInvoker();
    public enum MessageBoxButtons { OK, OKCancel, YesNo = 4 }
    public enum DialogResult { OK = 1, Cancel = 2, Yes = 6, No = 7 }

    /// What the pilot would see and hear, a line for each: kind, tab, text.
    public static class Screen {
        /// What the pilot answers to a question that contains this text; every other question is agreed to.
        public static string Refused = "Force";
        /// What the pilot types into an input box; empty: the pilot accepts the proposed text.
        public static string Answer = "";

        public static void Tell(string kind, string text) {
            lock (typeof(Screen)) Console.WriteLine(kind + "\t" + text.Replace("\r", "").Replace("\n", "\\n"));
        }

        public static bool Dialog(string text, string title) {
            Tell("dialog", title + ": " + text);
            return !text.Contains(Refused);
        }
    }

    public class Control { public string Name = "", Text = ""; public bool Enabled, Checked; public int SelectedIndex; public object SelectedValue; }

    /// The base of the windows, whose handlers are Mission Planner's own.
    public class Window : Control {
        protected static readonly log4net.ILog log = new log4net.Log();
        public static PointLatLngAlt MouseDownStart = new PointLatLngAlt(47.3985, 8.5465, 0);
        protected object Invoke(Delegate work) => work.DynamicInvoke();

        public static class CustomMessageBox {
            public enum MessageBoxButtons { OK, OKCancel, YesNo = 4 }
            public enum MessageBoxIcon { None, Exclamation, Information }
            public enum DialogResult { OK = 1, Cancel = 2, Yes = 6, No = 7 }
            public static int Show(string text, string title = "", MissionPlanner.MessageBoxButtons buttons = 0) =>
                (int)Show(text, title, (MessageBoxButtons)buttons, MessageBoxIcon.None);
            public static DialogResult Show(string text, string title, MessageBoxButtons buttons, MessageBoxIcon icon = 0,
                string yes = "Yes", string no = "No") {
                bool agreed = Screen.Dialog(text, title);
                if (buttons == MessageBoxButtons.YesNo) return agreed ? DialogResult.Yes : DialogResult.No;
                return agreed || buttons == MessageBoxButtons.OK ? DialogResult.OK : DialogResult.Cancel;
            }
        }

        protected static class InputBox {
            public static DialogResult Show(string title, string question, ref string text) {
                text = Screen.Answer == "" ? text : Screen.Answer;
                return DialogResult.OK;
            }
        }

        protected static class AltInputBox {
            public static DialogResult Show(string title, string question, ref string alt, ref MAVLink.MAV_FRAME frame) =>
                DialogResult.OK;
        }

        protected static class Application { public static void DoEvents() {} }
        protected static class Common {
            public static DialogResult MessageShowAgain(string title, string text) => DialogResult.OK;
        }
    }

    /// Runs the work in the foreground; an error or its message is a dialog.
    public class ProgressReporterDialogue : IProgressReporterDialogue {
        public event Utilities.DoWorkEventHandler DoWork;
        public ProgressWorkerEventArgs doWorkArgs { get; set; } = new ProgressWorkerEventArgs();
        public void Dispose() {}
        public void UpdateProgressAndStatus(int progress, string status) => Screen.Tell("progress", status);
        public void BeginInvoke(Delegate work) => work.DynamicInvoke();
        public bool Failed;

        public void RunBackgroundOperationAsync() {
            string error = null;
            try { DoWork?.Invoke(this); error = doWorkArgs.ErrorMessage; }
            catch (Exception unexpected) {
                error = doWorkArgs.ErrorMessage ?? "There was an unexpected error (" + unexpected.Message + ")";
            }
            Failed = !string.IsNullOrEmpty(error);
            if (Failed) Screen.Tell("dialog", "Error: " + error);
        }
    }

    /// The voice takes 60 ms for a character.
    public class Voice : ISpeech {
        DateTime busyUntil;
        public bool speechEnable { get; set; } = true;
        public bool IsReady => DateTime.Now > busyUntil;
        public void SpeakAsync(string text) {
            if (text == "") return;
            busyUntil = DateTime.Now.AddMilliseconds(60 * text.Length);
            Screen.Tell("voice", text);
        }
        public void SpeakAsyncCancelAll() {}
    }
}
