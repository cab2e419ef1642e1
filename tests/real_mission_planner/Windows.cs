// SPDX-License-Identifier: GPL-3.0-or-later
// The fields of Mission Planner's windows. Their handlers are taken from its sources (sources.py), and run unchanged.

using System;
using System.Collections;
using System.Collections.Generic;
using System.Linq;
using System.Threading;
using MissionPlanner.ArduPilot;
using MissionPlanner.Comms;
using MissionPlanner.Utilities;

namespace MissionPlanner {
    /// The main window: the link, and SerialReader, which reads it, sends heartbeats and speaks.
    public partial class MainV2 : Window {
        public static MAVLinkInterface comPort = new MAVLinkInterface();
        public static List<MAVLinkInterface> Comports = new List<MAVLinkInterface> { comPort };
        public static MainV2 instance = new MainV2();
        public static Voice speechEngine = new Voice();
        public static bool speechEnable = true;
        public static bool speechEnabled() => true;
        public static DateTime connecttime = DateTime.UtcNow;
        readonly ManualResetEvent SerialThreadrunner = new ManualResetEvent(false);
        DateTime heatbeatSend, nodatawarning;
        bool serialThread;
        public class Bar { public double Percent; }
        readonly Bar status1 = new Bar();

        void UpdateConnectIcon() {}
        void BeginInvoke(Delegate work) => work.DynamicInvoke();
        void BeginInvokeIfRequired(Action work) => work();

        static class ConfigTerminal { public static MAVLinkSerialPort comPort; }
        static class MyView { public static Control current; public static void ShowScreen(string name) {} }
        static class GCSViews { public static class FlightData { public static class myhud { public static void Invalidate() {} } } }
        static class FlightPlanner { public static void updateHome() {} }

        /// Menu Connect: the link, then the parameters (doConnect).
        public void Connect(int port) {
            MAVLinkInterface.CreateIProgressReporterDialogue += title => new ProgressReporterDialogue();
            CurrentState.Speech = speechEngine;
            comPort.BaseStream = new UdpSerial { Port = port.ToString() };
            connecttime = DateTime.UtcNow;
            SerialReader();
            comPort.Open(false);
            if (!comPort.BaseStream.IsOpen) return;
            comPort.getParamList();
        }
    }
}

namespace MissionPlanner.GCSViews {
    public partial class FlightData : Window {
        readonly Dictionary<string, Action<string>> CustomActions =
            Enum.GetNames(typeof(actions)).ToDictionary(name => name, name => (Action<string>)null);
        public readonly Control CMB_action = new Control(), CMB_modes = new Control(), CMB_setwp = new Control();
        public readonly Number modifyandSetAlt = new Number(), modifyandSetSpeed = new Number();
        public class Number : Control { public decimal Value; }
    }

    public partial class FlightPlanner : Window {
        public static FlightPlanner instance = new FlightPlanner();
        public List<Locationwp> Rows = new List<Locationwp>();
        public readonly Control TXT_homelat = new Control { Text = "45.3838" }, TXT_homelng = new Control { Text = "8.4733" };
        public readonly Control TXT_homealt = new Control { Text = "131" };
        public readonly Control TXT_WPRad = new Control { Text = "2" }, TXT_loiterrad = new Control { Text = "30" };
        public readonly Control cmb_missiontype = new Control { SelectedValue = MAVLink.MAV_MISSION_TYPE.MISSION };
        readonly Control chk_usemavftp = new Control();
        enum altmode { Relative = 3, Absolute = 0, Terrain = 10 }
        readonly altmode currentaltmode = altmode.Relative;
        class Grid { public List<Locationwp> Rows => instance.Rows; public int RowCount => Rows.Count; }
        readonly Grid Commands = new Grid();
        List<Locationwp> GetCommandList() => Rows.ToList();

        void WPtoScreen(List<Locationwp> items) {
            Rows = items;
            foreach (var item in items)
                Screen.Tell("item", FormattableString.Invariant(
                    $"{item.id} {item.frame} {item.p1} {item.p2} {item.p3} {item.p4} {item.lat:F7} {item.lng:F7} {item.alt}"));
        }

        bool Run(Utilities.DoWorkEventHandler work) {
            var dialogue = new ProgressReporterDialogue();
            dialogue.DoWork += work;
            dialogue.RunBackgroundOperationAsync();
            return !dialogue.Failed;
        }

        public void BUT_read_Click(object sender, EventArgs e) => Run(getWPs);
        public void BUT_write_Click(object sender, EventArgs e) => Run(saveWPs);
        public void but_writewpfast_Click(object sender, EventArgs e) => Run(saveWPsFast);
    }

    /// The page for the accelerometer.
    public partial class ConfigAccelerometerCalibration : Window {
        static readonly log4net.ILog Log = log;
        bool _incalibrate;
        int count, sub1, sub2;
        MAVLink.ACCELCAL_VEHICLE_POS pos;
        readonly Control BUT_calib_accell = new Control(), BUT_level = new Control(), BUT_simpleAccelCal = new Control();
        class Label { public string Text { set { Screen.Tell("accelerometer", value); } } }
        readonly Label lbl_Accel_user = new Label();
        public bool IsCalibrating => _incalibrate;
    }

    /// The page for the compass. Its timer is pressed like a button.
    public partial class ConfigHWCompass2 : Window {
        readonly bool rebootrequired = false;
        bool CheckReboot() => true;
        readonly List<MAVLink.MAVLinkMessage> mprog = new List<MAVLink.MAVLinkMessage>(), mrep = new List<MAVLink.MAVLinkMessage>();
        int packetsub1, packetsub2;
        class Clock { public int Interval; public void Start() {} public void Stop() {} }
        readonly Clock timer1 = new Clock();
        class Bar { public double Value; public string BackColor; }
        static class Color { public const string Green = "green"; }
        readonly Bar horizontalProgressBar1 = new Bar(), horizontalProgressBar2 = new Bar(), horizontalProgressBar3 = new Bar();
        readonly Bar pictureBox1 = new Bar(), pictureBox2 = new Bar(), pictureBox3 = new Bar();
        readonly Control BUT_OBmagcalaccept = new Control(), BUT_OBmagcalcancel = new Control();
        class Text { public void Clear() {} public void AppendText(string text) => Screen.Tell("compass", text.Trim()); }
        readonly Text lbl_obmagresult = new Text();
        void LogError(Exception error) => log.Error(error);
    }

    /// The window behind "Not Ready to Arm".
    public partial class PrearmStatus : Window {
        DateTime lastRequestTime = DateTime.MinValue, searchTime = DateTime.MinValue;
        class Box { public string Text { set { if (value != last) Screen.Tell("prearm", last = value); } } string last; }
        readonly Box TXT_PrearmErrors = new Box();
        void Close() {}
    }
}
